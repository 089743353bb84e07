// How the links of a room's stations do, over all that were ever there: each call of observe() counts every station once.
#pragma once

#include <map>
#include <vector>

#include "server/core/bin_counts.hpp"
#include "server/core/station.hpp"

namespace palpate {

struct StationLinks {
  BinCounts rtt_seconds{kSecondsEdges};        ///< mean round trip of the station
  BinCounts patch_age_seconds{kSecondsEdges};  ///< that its patches reach, as it says
  BinCounts lost_up{kShareEdges}, lost_down{kShareEdges};
  std::uint64_t ticks_late = 0;  ///< of all haptic loops, as they say

  void observe(const std::vector<StationReport>& stations);

 private:
  std::map<StationId, std::uint32_t> ticks_known_;  ///< of those who are there
};

}  // namespace palpate
