// What whoever runs a room decides about it.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/types.hpp"

namespace palpate {

struct ServerOptions {
  std::uint64_t instance = 1;  ///< drawn anew by each process, for each room
  double rate_hz = 20;
  std::string room = {};   ///< its name, for stations that ask for one; empty: it has none
  std::string rooms = {};  ///< names of all rooms of the process, for a station that asks for another
  double deadband = 0;     ///< share of a force below which a change is not sent (deadband.hpp), 0 = every patch is
};

}  // namespace palpate
