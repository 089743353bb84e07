// What Force Dimension's devices can do. The library does not say it, so it is kept here by type: peak force and stiffness as
// cautious figures of other users of the library have them (chai3d's device classes), below the maker's own.
#pragma once

#include "client/device/device.hpp"

namespace palpate::dhd {

struct Limits {
  double force_max_n = 0, force_continuous_n = 0, stiffness_max_n_m = 0;
  double radius_m = 0;  ///< of the workspace, a ball around the origin
};

/// By dhdGetSystemType(); nothing is known of an unknown type.
Limits limits_of(int type);

}  // namespace palpate::dhd
