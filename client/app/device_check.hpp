// The parts of palpate-client that look at devices without a server.
#pragma once

#include <atomic>

#include "client/app/options.hpp"

namespace palpate {

/// --list-devices: returns 0 when it finds a usable device, else 1.
int list_devices();

/// --check-device: returns 0 when the device works, else 1. Prompts for the force test on standard input. Throws InputError for
/// an unknown name and for a device that does not open.
int check_device(const AppOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
