// Options that the operator of a room chooses.
#pragma once

#include <string>
#include <vector>

#include "common/base/random.hpp"

namespace palpate {

struct ServerOptions {
  SecretSource draw;  ///< source of the secrets of sessions
  double rate_hz = 20;
  std::string room = {};                ///< name, for stations that ask for one; empty: none
  std::vector<std::string> rooms = {};  ///< names of all rooms of the process, for stations that may join another
  double deadband = 0;  ///< share of a force below which a change is not sent (deadband.hpp); 0 = every patch is sent
};

}  // namespace palpate
