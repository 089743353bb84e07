// Resets a server's body to rest from outside a session: joins as a viewer, asks, and leaves when it is done.
#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "common/base/types.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

/// Returns the reason for a failure; empty on success. `server` is HOST:PORT (InputError when it is not). Ends early once `stop`
/// is set.
std::string reset_body(const std::string& server, const std::string& station, const std::string& room, Micros longest,
                       const std::atomic<bool>& stop, const std::optional<ClientKeys>& keys = {});

}  // namespace palpate
