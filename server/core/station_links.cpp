#include "server/core/station_links.hpp"

#include <utility>

namespace palpate {

void StationLinks::observe(const std::vector<StationReport>& stations) {
  std::map<StationId, std::uint32_t> ticks;
  for (const StationReport& s : stations) {
    if (s.rtt.mean > Micros{0}) rtt_seconds.add(seconds(s.rtt.mean));
    if (s.patch_age > Micros{0}) patch_age_seconds.add(seconds(s.patch_age));
    if (s.lost_up) lost_up.add(*s.lost_up);
    if (s.lost_down) lost_down.add(*s.lost_down);
    // Late ticks before a station joined do not belong to this session. A count that falls has begun anew.
    const auto known = ticks_known_.find(s.id);
    if (known != ticks_known_.end() && s.ticks_late > known->second) ticks_late += s.ticks_late - known->second;
    ticks[s.id] = s.ticks_late;
  }
  ticks_known_ = std::move(ticks);
}

}  // namespace palpate
