#include "server/core/playout.hpp"

#include <algorithm>

namespace palpate {

Micros playout(const Stations& stations, Micros body_time, Micros now) {
  const auto punctual = [&](const Station& s) { return now - s.tool.heard() <= kLateAfter; };
  auto least_lag = Micros::max(), least_late = Micros::max();
  for (const auto& [id, station] : stations) {
    if (!station.pushes() || station.tool.timeline().empty()) continue;
    if (punctual(station))
      least_lag = std::min(least_lag, station.tool.buffer());
    else
      least_late = std::min(least_late, station.tool.lag());
  }
  auto known = Micros::max(), wait = Micros{};
  int waited_for = 0;
  for (const auto& [id, station] : stations) {
    if (!station.pushes() || station.tool.timeline().empty() || !punctual(station)) continue;
    known = std::min(known, station.tool.timeline().newest());
    wait = std::max(wait, std::min(station.tool.buffer(), least_lag + kMostWait));
    ++waited_for;
  }
  auto target = now;
  if (known != Micros::max()) {
    target = known;  // exactly a sample, even if it lies ahead of `now` by an error of the clocks
    if (waited_for > 1) target = std::max(target, now - wait);
  } else if (least_late != Micros::max()) {
    target = now - least_late;
  }
  return std::min(target, body_time + kLongestFrame);
}

}  // namespace palpate
