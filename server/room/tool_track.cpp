#include "server/room/tool_track.hpp"

#include <algorithm>

namespace palpate {

void ToolTrack::add(std::span<const ToolSample> samples) {
  for (const ToolSample& s : samples)
    if (samples_.empty() || s.t > samples_.back().t) samples_.push_back(s);
}

ToolAt ToolTrack::at(Micros t) const {
  if (t <= samples_.front().t) return {samples_.front().position, Vec3::Zero()};
  if (t > samples_.back().t) return {samples_.back().position, Vec3::Zero()};
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t, [](const ToolSample& s, Micros x) { return s.t < x; });
  const auto before = after - 1;
  const double length_s = seconds(after->t - before->t);
  const Vec3 velocity = (after->position - before->position) / length_s;
  return {before->position + seconds(t - before->t) * velocity, velocity};
}

void ToolTrack::forget_before(Micros t) {
  while (samples_.size() > 2 && samples_[1].t < t) samples_.pop_front();
}

}  // namespace palpate
