// Limits of Force Dimension's devices, by type, because the library does not report them. Peak force and stiffness are the
// cautious figures of other users of the library (chai3d's device classes), below the maker's own.
#pragma once

#include "client/device/device.hpp"

namespace palpate::dhd {

struct Limits {
  double force_max_n = 0, force_continuous_n = 0, stiffness_max_n_m = 0;
  double radius_m = 0;  ///< radius of the workspace, a ball around the origin
};

/// Returns the limits of a dhdGetSystemType(), all zero for an unknown type.
Limits limits_of(int type);

}  // namespace palpate::dhd
