// Cost of a server without stations: the real one, with its socket and threads, in real time.
#pragma once

#include <filesystem>
#include <span>

namespace palpate {

struct IdleCost {
  double core_share = 0;  ///< processor time of its threads, user and system, over wall time
  double wake_ups_s = 0;  ///< wake-ups of its threads per second
};

/// Measures a server with a room per scene and no station. Runs for `wait_s` and a little longer.
IdleCost idle_server(std::span<const std::filesystem::path> scenes, double wait_s);

}  // namespace palpate
