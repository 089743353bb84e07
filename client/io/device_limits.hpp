// The limits of the guard for a device, from the device's reported capabilities.
#pragma once

#include "client/device/device.hpp"
#include "client/guard/guard.hpp"

namespace palpate {

/// Throws InputError, naming the missing values, for a device that renders a force and does not report peak and continuous force,
/// slew, stiffness, speed and workspace, or a torque and not its peak, continuous torque, change and rate of rotation: nothing is
/// rendered without limits. A device without force may omit all of them; nobody feels its torque, which is recorded like its
/// force.
GuardLimits limits_of(const DeviceCaps& caps, PassivityMode passivity);

}  // namespace palpate
