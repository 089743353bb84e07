// What palpate-client says of devices without a server.
#pragma once

#include <atomic>

#include "client/app/options.hpp"

namespace palpate {

/// --list-devices: 0 when a device that can be used was found, else 1.
int list_devices();

/// --check-device: 0 when it serves, else 1. The force test is asked for on standard input. Throws InputError for a name that is
/// none and a device that does not open.
int check_device(const AppOptions& options, const std::atomic<bool>& stop);

}  // namespace palpate
