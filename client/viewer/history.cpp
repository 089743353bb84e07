#include "client/viewer/history.hpp"

#include <algorithm>

namespace palpate {

void History::add(Micros now, const std::string& station, float value) {
  auto at = std::find_if(series_.begin(), series_.end(), [&](const Series& s) { return s.station == station; });
  if (at == series_.end()) at = series_.insert(at, {station, {}});
  if (!at->points.empty() && now - at->points.back().at < kStep) return;
  at->points.push_back({now, value});
}

void History::forget(Micros now) {
  for (Series& s : series_)
    while (!s.points.empty() && now - s.points.front().at > kSpan) s.points.pop_front();
  std::erase_if(series_, [](const Series& s) { return s.points.empty(); });
}

float History::largest(float floor) const {
  for (const Series& s : series_)
    for (const Point& p : s.points) floor = std::max(floor, p.value);
  return floor;
}

}  // namespace palpate
