// A server from its flags to its end.
#pragma once

#include "server/app/server_flags.hpp"

namespace palpate {

/// Returns when it was told to end, in order. InputError for what is wrong with flags, scenes or keys.
void serve(const ServerFlags& flags);

}  // namespace palpate
