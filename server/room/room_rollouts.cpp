// Snapshots of where the body may be until the next patches: rollouts of its hands, the cache, a warm-start indentation.
#include <algorithm>
#include <cassert>
#include <span>

#include "server/room/hand_rollouts.hpp"
#include "server/room/room_state.hpp"

namespace palpate {

/// The mean over the last 60 ms; none where it came since.
Vec3 Room::State::hand_acceleration(const Station& station) const {
  assert(!station.track.empty());
  constexpr Micros kDifferenceStep{30'000};  // a step of 0.03 mm, an encoder's, is then up to 0.07 m/s^2; longer: lags more
  const Micros now = from_seconds(body.time_s);
  if (now - 2 * kDifferenceStep < station.track.begin()) return Vec3::Zero();
  const auto place = [&](Micros t) { return tool_at(station, t).position; };
  const Vec3 second_difference = place(now) - 2 * place(now - kDifferenceStep) + place(now - 2 * kDifferenceStep);
  const Vec3 acceleration = second_difference / (seconds(kDifferenceStep) * seconds(kDifferenceStep));
  return acceleration / std::max(1.0, acceleration.norm() / kHandAccelerationMostMs2);
}

/// As far as the steps converge; whether that is to the end.
bool Room::State::roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot) {
  assert(over_s > 0);
  BodyState next = body;
  std::vector<ToolPort> there = ports;
  const int snapshots = roughly ? kRoughRolloutSnapshots : kRolloutSnapshots;
  for (int k = 1; k <= snapshots; ++k) {
    const double until_s = body.time_s + k * over_s / snapshots;
    if (!(roughly ? roughly->advance(next, there, until_s, tool, snapshots + 1 - k)
                  : integrator.stepper->advance(next, there, until_s, integrator.step_s, tool).converged))
      return false;
    snapshot(k * (kRolloutSnapshots / snapshots), next.x);
  }
  return true;
}

/// How many rollouts of the hands fit into kFrameCostMostS. Each costs what the body costs over the prediction horizon; a body
/// that costs more than kBodyCostMax of a core has none. Rough steps count what they took; a body has none where they would not
/// get to the end of the first.
std::size_t Room::State::affordable_rollouts(Micros horizon) {
  constexpr double kBodyCostMax = 0.01;       // so a horizon of 0.2 s costs 2 ms a rollout at most
  constexpr double kFrameCostMostS = 0.0125;  // by estimate: a quarter of a frame at 20 Hz
  std::size_t rollouts = seconds(horizon) < kPredictableS ? kUndeviatedRollouts : kHandRollouts.size();
  if (roughly) return roughly->allow(kFrameCostMostS, kRoughRolloutSnapshots) ? rollouts : 0;
  if (integrator.cost > kBodyCostMax) return 0;
  const double each_s = integrator.cost * seconds(horizon);
  while (rollouts > kRolloutsLeast && static_cast<double>(rollouts) * each_s > kFrameCostMostS) --rollouts;
  return rollouts;
}

/// None where the likeliest rollout does not get to its end: modes of where the body is before count for less than those
/// that they would take the place of.
std::vector<PredictedState> Room::State::hand_rollouts(Micros horizon) {
  std::vector<ToolAt> now;
  std::vector<Vec3> acceleration;
  assert(port_owner.size() == ports.size());
  for (const StationId id : port_owner) {
    now.push_back(tool_at(stations.at(id), from_seconds(body.time_s)));
    acceleration.push_back(hand_acceleration(stations.at(id)));
  }
  std::vector<PredictedState> ahead;
  for (const HandRollout& rollout : std::span(kHandRollouts).first(affordable_rollouts(horizon))) {
    const auto tool = [&](std::size_t k, double t) {
      if (rollout.dead_reckoned) return tool_at(stations.at(port_owner[k]), from_seconds(t));
      return moved_on(now[k], rollout.accelerates ? Vec3(acceleration[k] + rollout.beside_m_s2) : Vec3(Vec3::Zero()),
                      t - body.time_s);
    };
    const bool to_its_end = roll_out(seconds(horizon), tool, [&](int snapshot, const Vector& x) {
      if (snapshot * rollout.snapshots % kRolloutSnapshots != 0) return;
      const bool end = snapshot == kRolloutSnapshots && rollout.beside_m_s2.isZero(0);
      ahead.push_back({end ? SnapshotKind::rollout_end : SnapshotKind::rollout, rollout.weight, x});
    });
    if (rollout.dead_reckoned && !to_its_end) return {};
  }
  return ahead;
}

/// Warm-start indentation. A sleeping body knows nothing of the hand that will wake it: where one is near it is pressed as by a
/// hand that speeds up, from the surface to as deep as such a hand gets, once for every place. That costs what the body costs in
/// kPressS; bodies that cost more than kPressCostMostS for it are left alone.
void Room::State::warm_start(const std::vector<std::size_t>& feeling) {
  constexpr double kPressS = 0.25;          // in which a hand that speeds up gets to kFromRestMostM
  constexpr double kPressCostMostS = 0.04;  // by estimate: less than a frame at 20 Hz, once for a place
  constexpr std::size_t kPlacesMax = 16;    // that count as pressed; the cache holds five presses at most
  if (integrator.cost * kPressS > kPressCostMostS) return;
  std::vector<Vec3> from, inwards(ports.size(), Vec3::Zero()), places;
  bool anew = false;
  for (std::size_t k = 0; k < ports.size(); ++k) from.push_back(frame_model.tool(k).position);
  for (const std::size_t k : feeling) {
    if (ports[k].kind == ContactKind::attach) continue;
    from[k] = position_at(skin.view(), frame_model.positions(), ports[k].point);
    inwards[k] = -normal_at(skin.view(), frame_model.positions(), ports[k].point);
    const Vec3& place = places.emplace_back(frame_model.place_of(ports[k]));
    if (std::any_of(warm_started.begin(), warm_started.end(),
                    [&](const Vec3& known) { return snapshot_cache.alike(known, place); }))
      continue;
    anew = true;
    if (warm_started.size() == kPlacesMax) warm_started.pop_front();
    warm_started.push_back(place);
  }
  if (!anew) return;
  const auto tool = [&](std::size_t k, double t) {
    const double after_s = t - body.time_s;
    return ToolAt{from[k] + accelerated_distance(after_s) * inwards[k], accelerated_speed(after_s) * inwards[k]};
  };
  roll_out(kPressS, tool, [&](int, const Vector& x) { snapshot_cache.keep(places, x); });
}

/// A basis that knows where the body may be is truer there. Snapshots of the cache are less likely to come back than those of
/// rollouts are to come, and count for less, in finely meshed bodies above all. Bodies that are stepped roughly, solids mostly,
/// gain nothing by the cache.
void Room::State::collect_snapshots(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros horizon) {
  std::vector<std::size_t> feeling;
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    if (!gets_patch[k] || job.stations[k].scheme != Scheme::hyper) continue;
    const std::size_t which = *port_of(job.stations[k]);
    if (!kept_for(job.stations[k], which)) feeling.push_back(which);
  }
  if (feeling.empty() || !job.rollouts) return;
  std::vector<PredictedState> predicted;
  if (!asleep) predicted = hand_rollouts(horizon);
  if (!roughly) add_cached(feeling, predicted);
  frame_model.set_predicted_states(std::move(predicted));
}

/// Of the snapshot cache, which then takes in the body as it is.
void Room::State::add_cached(const std::vector<std::size_t>& feeling, std::vector<PredictedState>& predicted) {
  constexpr double kCachedWeight = 0.06, kCachedWeightBesideRollouts = 0.03;  // tuned: docs/notebook/0030, 0053
  const double weight = predicted.empty() ? kCachedWeight : kCachedWeightBesideRollouts;
  if (asleep) warm_start(feeling);
  std::vector<Vec3> near, holding;
  for (const std::size_t k : feeling) near.push_back(frame_model.place_of(ports[k]));
  for (const Vector* x : snapshot_cache.most_informative(near, body.x)) predicted.push_back({SnapshotKind::cached, weight, *x});
  for (const ToolPort& port : ports)
    if (port.kind == ContactKind::attach || port.touching) holding.push_back(frame_model.place_of(port));
  if (!holding.empty()) snapshot_cache.keep(holding, body.x);
}

}  // namespace palpate
