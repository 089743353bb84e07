#include "server/room/tool_track.hpp"

#include <algorithm>
#include <cassert>

#include "server/reduction/tool_prediction.hpp"

namespace palpate {
namespace {

/// Returns the position of `wanted`, moved towards `last` so that the speed between them stays within kFastestMs.
Vec3 within_reach(const ToolSample& last, const ToolSample& wanted) {
  const Vec3 way = wanted.position - last.position;
  return last.position + way / std::max(1.0, way.norm() / (ToolTrack::kFastestMs * seconds(wanted.t - last.t)));
}

}  // namespace

void ToolTrack::add(std::span<const ToolSample> samples, Micros body_time) {
  const bool gone_past = !empty() && body_time > newest();
  const ToolAt before = gone_past ? at(body_time) : ToolAt{};
  for (const ToolSample& s : samples)
    if (empty())
      samples_.add(s);
    else if (s.t > newest())
      samples_.add({s.t, within_reach(samples_.newest(), s)});
  if (gone_past) lead_on(before.position, body_time);
}

/// Leads the tool from `from` back to its path.
void ToolTrack::lead_on(const Vec3& from, Micros body_time) {
  lead_ = {body_time, kLeadBack, from - on_path(body_time).position};
}

ToolAt ToolTrack::at(Micros t) const { return moved_by(on_path(t), lead_, t); }

ToolAt ToolTrack::on_path(Micros t) const {
  assert(!empty());
  const std::size_t after = samples_.first_after(t - Micros{1});
  if (after == 0) return {samples_.oldest().position, Vec3::Zero()};
  if (after == samples_.size()) {
    const ToolSample& end = samples_.newest();
    if (samples_.size() == 1) return {end.position, Vec3::Zero()};
    // If samples are further apart, the last two are used.
    const std::size_t first = samples_.first_after(end.t - kVelocityWindow - Micros{1});
    const ToolSample& from = samples_[std::min(first, samples_.size() - 2)];
    const Vec3 velocity = (end.position - from.position) / seconds(end.t - from.t);
    return dead_reckoned({end.position, velocity}, seconds(t - end.t));
  }
  const ToolSample &before = samples_[after - 1], &next = samples_[after];
  const Vec3 velocity = (next.position - before.position) / seconds(next.t - before.t);
  return {before.position + seconds(t - before.t) * velocity, velocity};
}

void ToolTrack::forget_before(Micros t) {
  if (!empty()) samples_.forget_before(std::min(t, newest() - kVelocityWindow) - Micros{1}, 2);
}

}  // namespace palpate
