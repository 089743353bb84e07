// Link statistics over all stations that a room ever had: each call of observe() counts every present station once.
#pragma once

#include <map>
#include <vector>

#include "server/core/bin_counts.hpp"
#include "server/core/station.hpp"

namespace palpate {

struct StationLinks {
  BinCounts rtt_seconds{kSecondsEdges};        ///< mean round trip of the station
  BinCounts patch_age_seconds{kSecondsEdges};  ///< age that its patches reach, as it reports
  BinCounts lost_up{kShareEdges}, lost_down{kShareEdges};
  std::uint64_t ticks_late = 0;  ///< sum over all haptic loops, as reported

  void observe(const std::vector<StationReport>& stations);

 private:
  std::map<StationId, std::uint32_t> ticks_known_;  ///< counts already added, for present stations
};

}  // namespace palpate
