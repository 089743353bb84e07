#include "server/room/tool_track.hpp"

#include <algorithm>
#include <cassert>

#include "common/base/minimum_jerk.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {
namespace {

/// Returns the position of `wanted`, moved towards `last` so that the speed between them stays within kFastestMs.
Vec3 within_reach(const ToolSample& last, const ToolSample& wanted) {
  const Vec3 way = wanted.position - last.position;
  return last.position + way / std::max(1.0, way.norm() / (ToolTrack::kFastestMs * seconds(wanted.t - last.t)));
}

}  // namespace

void ToolTrack::add(std::span<const ToolSample> samples, Micros body_time) {
  const bool gone_past = !empty() && body_time > samples_.back().t;
  const ToolAt before = gone_past ? at(body_time) : ToolAt{};
  for (const ToolSample& s : samples)
    if (samples_.empty())
      samples_.push_back(s);
    else if (s.t > samples_.back().t)
      samples_.push_back({s.t, within_reach(samples_.back(), s)});
  if (!gone_past) return;
  lead_on(before.position, body_time);
}

void ToolTrack::set_quiescence_tolerance(Micros from, Micros to) { lead_on(at(from).position, to); }

/// Leads the tool from `from` back to its path.
void ToolTrack::lead_on(const Vec3& from, Micros body_time) {
  offset_ = from - on_path(body_time).position;
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
    // If samples are further apart, the last two are used.
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
