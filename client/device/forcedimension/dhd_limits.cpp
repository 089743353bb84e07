#include "client/device/forcedimension/dhd_limits.hpp"

#include "client/device/forcedimension/dhd_abi.hpp"

namespace palpate::dhd {

Limits limits_of(int type) {
  switch (type) {
    case type::kOmega3:
    case type::kOmega6Right:
    case type::kOmega6Left:
    case type::kOmega7Right:
    case type::kOmega7Left:
      return {12, 12, 5000, 0, 0.075};
    case type::kDelta3:
      return {20, 20, 5000, 0, 0.15};
    case type::kSigma3:
      return {12, 12, 4000, 0, 0.095};
    case type::kSigma7Right:
    case type::kSigma7Left:
      return {12, 12, 4000, 0.24, 0.095};
    case type::kLambda3:
    case type::kLambda6Right:
    case type::kLambda6Left:
    case type::kLambda7Right:
    case type::kLambda7Left:
      return {12, 12, 8000, 0, 0.1125};
    // The maker of the Falcon states no continuous force: a quarter of the peak is our own guess on the safe side.
    case type::kFalcon:
      return {8, 2, 3000, 0, 0.04};
    default:
      return {};
  }
}

}  // namespace palpate::dhd
