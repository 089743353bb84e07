#include "server/core/timeline.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

bool Timeline::add(Micros t_station, Micros t_server, const Vec3& position) {
  if (!empty()) {
    if (t_station < entries_.back().t_station + kLeastApart) return false;
    t_server = std::max(t_server, newest() + Micros{1});
  }
  entries_.push_back({t_station, t_server, position});
  if (entries_.size() > kMost) entries_.pop_front();
  return true;
}

void Timeline::forget_after(Micros t_station) {
  while (!empty() && entries_.back().t_station > t_station) entries_.pop_back();
}

void Timeline::forget_before(Micros t_server) {
  while (entries_.size() > 1 && entries_.front().t_server < t_server) entries_.pop_front();
}

Micros Timeline::to_station(Micros t_server) const {
  const auto later = std::lower_bound(entries_.begin(), entries_.end(), t_server,
                                      [](const Entry& entry, Micros t) { return entry.t_server < t; });
  if (later == entries_.end()) return t_server + (entries_.back().t_station - entries_.back().t_server);
  if (later->t_server == t_server || later == entries_.begin()) return t_server + (later->t_station - later->t_server);
  const auto& a = *(later - 1);
  const auto& b = *later;
  const double share = seconds(t_server - a.t_server) / seconds(b.t_server - a.t_server);
  return a.t_station + Micros{std::llround(share * static_cast<double>((b.t_station - a.t_station).count()))};
}

std::vector<ToolSample> Timeline::between(Micros after, Micros target) const {
  std::vector<ToolSample> samples;
  auto entry = std::upper_bound(entries_.begin(), entries_.end(), after, [](Micros t, const Entry& e) { return t < e.t_server; });
  if (entry != entries_.begin()) --entry;
  for (; entry != entries_.end(); ++entry) {
    samples.push_back({entry->t_server, entry->position});
    if (entry->t_server >= target) break;
  }
  return samples;
}

}  // namespace palpate
