#include "server/room/tool_track.hpp"

#include <algorithm>
#include <cassert>

#include "common/base/minimum_jerk.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {

void ToolTrack::add(std::span<const ToolSample> samples, Micros body_time) {
  const bool gone_past = !empty() && body_time > samples_.back().t;
  const ToolAt before = gone_past ? at(body_time) : ToolAt{};
  for (const ToolSample& s : samples)
    if (samples_.empty() || s.t > samples_.back().t) samples_.push_back(s);
  if (!gone_past) return;
  offset_ = before.position - on_path(body_time).position;
  led_from_ = body_time;
}

ToolAt ToolTrack::at(Micros t) const {
  assert(!empty());
  ToolAt tool = on_path(t);
  if (offset_.isZero(0) || t >= led_from_ + kLeadBack) return tool;
  const double length_s = seconds(kLeadBack), share = seconds(t - led_from_) / length_s;
  tool.position += (1 - minimum_jerk(share)) * offset_;
  tool.velocity -= (minimum_jerk_rate(share) / length_s) * offset_;
  return tool;
}

ToolAt ToolTrack::on_path(Micros t) const {
  assert(!empty());
  if (t <= samples_.front().t) return {samples_.front().position, Vec3::Zero()};
  if (t > samples_.back().t) {
    const ToolSample& end = samples_.back();
    if (samples_.size() == 1) return {end.position, Vec3::Zero()};
    // Where samples lie further apart the last two tell.
    const auto from = std::lower_bound(samples_.begin(), samples_.end() - 2, end.t - kVelocityWindow,
                                       [](const ToolSample& s, Micros x) { return s.t < x; });
    const Vec3 velocity = (end.position - from->position) / seconds(end.t - from->t);
    return dead_reckoned({end.position, velocity}, seconds(t - end.t));
  }
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), t, [](const ToolSample& s, Micros x) { return s.t < x; });
  const auto before = after - 1;
  const double length_s = seconds(after->t - before->t);
  assert(length_s > 0);
  const Vec3 velocity = (after->position - before->position) / length_s;
  return {before->position + seconds(t - before->t) * velocity, velocity};
}

void ToolTrack::forget_before(Micros t) {
  if (empty()) return;
  t = std::min(t, newest() - kVelocityWindow);
  while (samples_.size() > 2 && samples_[1].t < t) samples_.pop_front();
}

}  // namespace palpate
