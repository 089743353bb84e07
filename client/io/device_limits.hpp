// What the guard holds a device to, out of what the device says that it can do.
#pragma once

#include "client/device/device.hpp"
#include "client/guard/guard.hpp"

namespace palpate {

/// Throws InputError, naming what is missing, for a device that renders a force and does not say peak and continuous force, slew,
/// stiffness, speed and workspace: without limits nothing is rendered. A device that renders none may leave all of them out.
GuardLimits limits_of(const DeviceCaps& caps, PassivityMode passivity);

}  // namespace palpate
