// The body moves on, or sleeps.
#include <algorithm>
#include <cassert>

#include "server/room/room_state.hpp"

namespace palpate {

/// If it may. What is left of its motion goes: the body stays where it is to the bit.
void Room::State::fall_asleep() {
  const bool alone =
      std::none_of(ports.begin(), ports.end(), [](const ToolPort& p) { return p.kind == ContactKind::attach || p.touching; });
  asleep = alone && stillness.holds(body);
  if (asleep) body.v.setZero();
}

/// Whether a tool that does not touch may meet the body, where it is, before `until`.
bool Room::State::may_meet(std::size_t which, Micros until) {
  assert(which < ports.size());
  constexpr double kStrayMarginM = 0.001;  // a hand strays less between two checks
  if (ports[which].kind == ContactKind::attach) return true;
  const Station& station = stations.at(port_owner[which]);
  const Micros begin = from_seconds(body.time_s);
  const Vec3 from = tool_at(station, begin).position;
  double way_m = (tool_at(station, until).position - from).norm();
  for (Micros t = begin; t < until; t += kTick) way_m = std::max(way_m, (tool_at(station, t).position - from).norm());
  return nearest_within(
             which, from, way_m + kStrayMarginM, [this]() -> const auto& { return placed = skin.place(body.x); })
      .has_value();
}

/// Where the surface is nearest to a tool, if it is nearer than `far_m`. Over a sleeping body it is looked for only when the tool
/// may have got so near since it was looked for last. `positions()`: of the skin's vertices.
std::optional<NearestPoint> Room::State::nearest_within(std::size_t which, const Vec3& tool, double far_m,
                                                        const std::function<const std::vector<double>&()>& positions) {
  std::optional<MeasuredHeight>& measured_height = stations.at(port_owner[which]).measured_height;
  if (skin.empty() || (measured_height && measured_height->least_height_m(tool) >= far_m)) return std::nullopt;
  const NearestPoint nearest = nearest_point(skin.view(), positions(), tool);
  if (asleep) measured_height = MeasuredHeight{tool, nearest.height_m};
  return nearest.height_m < far_m ? std::optional(nearest) : std::nullopt;
}

bool Room::State::sleeps_through(const FrameJob& job) {
  if (!asleep || !job.may_sleep) return false;
  for (std::size_t k = 0; k < ports.size(); ++k)
    if (may_meet(k, job.target)) return false;
  return true;
}

// A frame that has to make up for lost time (the machine was busy) costs no more than kCatchUpFramesMax frames: its steps grow
// instead. A room that fell behind by more steps of the same length would fall behind further.
AdvanceReport Room::State::advance(const FrameJob& job) {
  constexpr int kCatchUpFramesMax = 2;  // more: truer steps, and frames that come later
  double step_s = integrator.step_s;
  const double behind = (seconds(job.target) - body.time_s) / std::max(kCatchUpFramesMax * seconds(job.frame), 1e-9);
  if (job.frame > Micros{} && behind > 1) step_s *= behind;
  // Half of what a hand may feel of anything that is not computed, which is a fifth of what the hand-over of patches hides.
  constexpr double kLeftOutForceN = 0.005;
  integrator.stepper->leave_out(job.may_sleep ? kLeftOutForceN : 0);
  return integrator.stepper->advance(body, ports, seconds(job.target), step_s, [&](std::size_t k, double t) {
    return tool_at(stations.at(port_owner[k]), from_seconds(t));
  });
}

}  // namespace palpate
