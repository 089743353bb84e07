#include "server/core/timeline.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

bool Timeline::add(const ToolSample& sample, Micros t_server) {
  if (!empty()) {
    if (sample.t < entries_.newest().t_station + kLeastApart) return false;
    t_server = std::max(t_server, newest() + Micros{1});
  }
  entries_.add({t_server, sample.t, sample.position, sample.orientation, sample.opening});
  return true;
}

void Timeline::forget_after(Micros t_station) {
  while (!empty() && entries_.newest().t_station > t_station) entries_.drop_newest();
}

Micros Timeline::to_station(Micros t_server) const {
  const std::size_t after = entries_.first_after(t_server);
  const Entry& a = entries_[after > 0 ? after - 1 : 0];
  if (after == 0 || after == entries_.size() || a.t == t_server) return t_server + (a.t_station - a.t);
  const Entry& b = entries_[after];
  const double share = seconds(t_server - a.t) / seconds(b.t - a.t);
  return a.t_station + Micros{std::llround(share * static_cast<double>((b.t_station - a.t_station).count()))};
}

std::vector<ToolSample> Timeline::between(Micros after, Micros target) const {
  std::vector<ToolSample> samples;
  const std::size_t next = entries_.first_after(after);
  for (std::size_t i = next > 0 ? next - 1 : 0; i < entries_.size(); ++i) {
    samples.push_back({entries_[i].t, entries_[i].position, entries_[i].orientation, entries_[i].opening});
    if (entries_[i].t >= target) break;
  }
  return samples;
}

}  // namespace palpate
