// Runs a server from its flags to its end.
#pragma once

#include "server/app/server_flags.hpp"

namespace palpate {

/// Returns after an orderly shutdown. Throws InputError for faults of flags, scenes or keys.
void serve(const ServerFlags& flags);

}  // namespace palpate
