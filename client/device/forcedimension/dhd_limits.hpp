// Limits of Force Dimension's devices, by type, because the library does not report them. Peak force and stiffness are the
// cautious figures of other users of the library (chai3d's device classes), below the maker's own. Torque is rendered by the
// sigma.7 alone: 0.24 of the maker's 0.4 N m, the share that the force has of its peak. An omega.6 or .7 measures rotation and
// has no motors for it; of a lambda.7 no figure was found.
#pragma once

#include "client/device/device.hpp"

namespace palpate::dhd {

struct Limits {
  double force_max_n = 0, force_continuous_n = 0, stiffness_max_n_m = 0;
  double torque_max_nm = 0;  ///< also continuous; 0: not known, so that no torque is rendered
  double radius_m = 0;       ///< radius of the workspace, a ball around the origin
};

/// Returns the limits of a dhdGetSystemType(), all zero for an unknown type.
Limits limits_of(int type);

}  // namespace palpate::dhd
