#include "server/room/tool_track.hpp"

#include <algorithm>
#include <cassert>

#include "common/base/rotation_vector.hpp"
#include "server/reduction/tool_prediction.hpp"

namespace palpate {
namespace {

Rotation turned(const Vec3& by, const Rotation& from) { return by.isZero(0) ? from : Rotation(rotation_by(by) * from); }

/// Returns `wanted`, moved towards `last` so that speed and spin between them stay within kFastestMs and kFastestRadS.
ToolSample within_reach(const ToolSample& last, const ToolSample& wanted) {
  ToolSample sample = wanted;
  const double time_s = seconds(wanted.t - last.t);
  const Vec3 way = wanted.position - last.position;
  sample.position = last.position + way / std::max(1.0, way.norm() / (ToolTrack::kFastestMs * time_s));
  if (last.orientation && wanted.orientation) {
    const double angle = last.orientation->angularDistance(*wanted.orientation);
    if (angle > ToolTrack::kFastestRadS * time_s)
      sample.orientation = Rotation(last.orientation->slerp(ToolTrack::kFastestRadS * time_s / angle, *wanted.orientation));
  }
  const double most = ToolTrack::kFastestOpening1S * time_s;
  sample.opening = std::clamp(wanted.opening, last.opening - most, last.opening + most);
  return sample;
}

}  // namespace

ToolAt TurningTool::centre_of(const ToolSphere& sphere) const {
  const Vec3 arm = turn * sphere.centre_at(opening);
  Vec3 velocity = at.velocity + spin.cross(arm);
  if (opens_1_s != 0) velocity += opens_1_s * (turn * sphere.swept(opening));
  return {at.position + arm, velocity, turn * Vec3::UnitZ(), turn * Vec3::UnitX()};
}

void ToolTrack::add(std::span<const ToolSample> samples, Micros body_time) {
  const bool gone_past = !empty() && body_time > newest();
  const TurningTool before = gone_past ? turning(body_time) : TurningTool{};
  for (const ToolSample& s : samples)
    if (empty())
      samples_.add(s);
    else if (s.t > newest())
      samples_.add(within_reach(samples_.newest(), s));
  if (gone_past) lead_on(before, body_time);
}

/// Leads the tool from `from` back to its path.
void ToolTrack::lead_on(const TurningTool& from, Micros body_time) {
  const TurningTool path = on_path(body_time);
  lead_ = {body_time, kLeadBack, from.at.position - path.at.position};
  lead_turn_ = {body_time, kLeadBack, rotation_between(path.turn, from.turn)};
  lead_opening_ = {body_time, kLeadBack, {from.opening - path.opening, 0, 0}};
}

TurningTool ToolTrack::turning(Micros t) const {
  TurningTool tool = on_path(t);
  tool.at = moved_by(tool.at, lead_, t);
  if (!lead_opening_.over(t)) {
    tool.opening = std::clamp(tool.opening + lead_opening_.at(t).x(), 0.0, 1.0);
    tool.opens_1_s += lead_opening_.rate(t).x();
  }
  if (lead_turn_.over(t)) return tool;
  tool.turn = turned(lead_turn_.at(t), tool.turn);
  tool.spin += lead_turn_.rate(t);
  return tool;
}

TurningTool ToolTrack::on_path(Micros t) const {
  assert(!empty());
  const auto resting = [](const ToolSample& at) {
    return TurningTool{{at.position, Vec3::Zero()}, ToolPose(at).turn, Vec3::Zero(), at.opening};
  };
  const std::size_t after = samples_.first_after(t - Micros{1});
  if (after == 0) return resting(samples_.oldest());
  if (after == samples_.size()) {
    const ToolSample& end = samples_.newest();
    if (samples_.size() == 1) return resting(end);
    // If samples are further apart, the last two are used.
    const std::size_t first = samples_.first_after(end.t - kVelocityWindow - Micros{1});
    const ToolSample& from = samples_[std::min(first, samples_.size() - 2)];
    const double over_s = seconds(end.t - from.t), gone_s = seconds(t - end.t);
    TurningTool tool{dead_reckoned({end.position, (end.position - from.position) / over_s}, gone_s), ToolPose(end).turn};
    const ToolAt opened = dead_reckoned({{end.opening, 0, 0}, {(end.opening - from.opening) / over_s, 0, 0}}, gone_s);
    tool.opening = std::clamp(opened.position.x(), 0.0, 1.0);
    tool.opens_1_s = tool.opening == opened.position.x() ? opened.velocity.x() : 0;
    if (!end.orientation || !from.orientation) return tool;
    const ToolAt spun = dead_reckoned({Vec3::Zero(), rotation_between(*from.orientation, *end.orientation) / over_s}, gone_s);
    tool.turn = turned(spun.position, tool.turn);
    tool.spin = spun.velocity;
    return tool;
  }
  const ToolSample &before = samples_[after - 1], &next = samples_[after];
  const double over_s = seconds(next.t - before.t), gone_s = seconds(t - before.t);
  const Vec3 velocity = (next.position - before.position) / over_s;
  TurningTool tool{{before.position + gone_s * velocity, velocity}, ToolPose(before).turn};
  tool.opens_1_s = (next.opening - before.opening) / over_s;
  tool.opening = before.opening + gone_s * tool.opens_1_s;
  if (!before.orientation || !next.orientation) return tool;
  tool.spin = rotation_between(*before.orientation, *next.orientation) / over_s;
  tool.turn = turned(gone_s * tool.spin, tool.turn);
  return tool;
}

ToolSample ToolTrack::sample(Micros t) const {
  const TurningTool tool = on_path(t);
  return {t, tool.at.position, samples_.newest().orientation ? Orientation(tool.turn) : Orientation(), tool.opening};
}

void ToolTrack::forget_before(Micros t) {
  if (!empty()) samples_.forget_before(std::min(t, newest() - kVelocityWindow) - Micros{1}, 2);
}

}  // namespace palpate
