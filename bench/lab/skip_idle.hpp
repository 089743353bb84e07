// What a server costs that has nothing to do: the real one, with its socket and threads, in real time.
#pragma once

#include <filesystem>
#include <span>

namespace palpate {

struct IdleCost {
  double core_share = 0;  ///< processor time of its threads, user and system, over the wall's
  double wake_ups_s = 0;  ///< of its threads, a second
};

/// Each scene is a room, and nobody is there. Runs for `wait_s` and a little longer.
IdleCost idle_server(std::span<const std::filesystem::path> scenes, double wait_s);

}  // namespace palpate
