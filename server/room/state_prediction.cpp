// Rollouts of the hands, the cache, a warm-start indentation.
#include "server/room/state_prediction.hpp"

#include <algorithm>
#include <cassert>
#include <span>

#include "server/room/hand_rollouts.hpp"

namespace palpate {

StatePrediction::StatePrediction(SteppedBody& body, FrameModel& frame_model)
    : body_(&body), frame_model_(&frame_model), snapshot_cache_(mean_edge_m(body.dynamics().body())) {
  if (!body.integrator().stepper->is_stateless() || body.dynamics().body().is_solid())
    roughly_.emplace(body.dynamics(), body.skin());
}

void StatePrediction::clear() {
  snapshot_cache_.clear();
  warm_started_.clear();
}

/// A basis that knows where the body may be is more accurate there. Snapshots of the cache are less likely to come back than
/// those of rollouts are to come, and count for less, in finely meshed bodies above all. Bodies that are stepped roughly, solids
/// mostly, gain nothing by the cache.
std::vector<PredictedState> StatePrediction::states(const std::vector<std::size_t>& tools, Micros horizon) {
  std::vector<PredictedState> predicted;
  if (!body_->asleep()) predicted = hand_rollouts(horizon);
  if (!roughly_) add_cached(tools, predicted);
  return predicted;
}

bool StatePrediction::roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot) {
  assert(over_s > 0);
  BodyState next = body_->state();
  std::vector<ToolPort> there = body_->ports();
  const int snapshots = roughly_ ? kRoughRolloutSnapshots : kRolloutSnapshots;
  for (int k = 1; k <= snapshots; ++k) {
    const double until_s = body_->state().time_s + k * over_s / snapshots;
    if (!(roughly_ ? roughly_->advance(next, there, until_s, tool, snapshots + 1 - k)
                   : body_->integrator().stepper->advance(next, there, until_s, body_->integrator().step_s, tool).converged))
      return false;
    snapshot(k * (kRolloutSnapshots / snapshots), next.x);
  }
  return true;
}

/// How many rollouts of the hands fit into kFrameCostMostS. Each costs what the body costs over the prediction horizon; a body
/// that costs more than kBodyCostMax of a core has none. Rough steps count what they took; a body has none where they would not
/// get to the end of the first.
std::size_t StatePrediction::affordable_rollouts(Micros horizon) {
  constexpr double kBodyCostMax = 0.01;       // so a horizon of 0.2 s costs 2 ms a rollout at most
  constexpr double kFrameCostMostS = 0.0125;  // by estimate: a quarter of a frame at 20 Hz
  std::size_t rollouts = seconds(horizon) < kPredictableS ? kUndeviatedRollouts : kHandRollouts.size();
  if (roughly_) return roughly_->allow(kFrameCostMostS, kRoughRolloutSnapshots) ? rollouts : 0;
  if (body_->integrator().cost > kBodyCostMax) return 0;
  const double each_s = body_->integrator().cost * seconds(horizon);
  while (rollouts > kRolloutsLeast && static_cast<double>(rollouts) * each_s > kFrameCostMostS) --rollouts;
  return rollouts;
}

/// None where the likeliest rollout does not get to its end: modes of where the body is before count for less than those
/// that they would take the place of.
std::vector<PredictedState> StatePrediction::hand_rollouts(Micros horizon) {
  std::vector<ToolAt> now;
  std::vector<Vec3> acceleration;
  for (std::size_t k = 0; k < body_->ports().size(); ++k) {
    now.push_back(body_->tool(k, body_->time()));
    acceleration.push_back(body_->hand_motion(k).acceleration);
  }
  std::vector<PredictedState> ahead;
  for (const HandRollout& rollout : std::span(kHandRollouts).first(affordable_rollouts(horizon))) {
    const auto tool = [&](std::size_t k, double t) {
      if (rollout.dead_reckoned) return body_->tool(k, from_seconds(t));
      return moved_on(now[k], rollout.accelerates ? Vec3(acceleration[k] + rollout.beside_m_s2) : Vec3(Vec3::Zero()),
                      t - body_->state().time_s);
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
void StatePrediction::warm_start(const std::vector<std::size_t>& tools) {
  constexpr double kPressS = 0.25;          // in which a hand that speeds up gets to kFromRestMostM
  constexpr double kPressCostMostS = 0.04;  // by estimate: less than a frame at 20 Hz, once for a place
  constexpr std::size_t kPlacesMax = 16;    // that count as pressed; the cache holds five presses at most
  if (body_->integrator().cost * kPressS > kPressCostMostS) return;
  const std::vector<ToolPort>& ports = body_->ports();
  std::vector<Vec3> from, inwards(ports.size(), Vec3::Zero()), places;
  bool anew = false;
  for (std::size_t k = 0; k < ports.size(); ++k) from.push_back(frame_model_->tool(k).position);
  for (const std::size_t k : tools) {
    if (ports[k].kind == ContactKind::attach) continue;
    from[k] = position_at(body_->skin().view(), frame_model_->positions(), ports[k].point);
    inwards[k] = -normal_at(body_->skin().view(), frame_model_->positions(), ports[k].point);
    const Vec3& place = places.emplace_back(frame_model_->place_of(ports[k]));
    if (std::any_of(warm_started_.begin(), warm_started_.end(),
                    [&](const Vec3& known) { return snapshot_cache_.alike(known, place); }))
      continue;
    anew = true;
    if (warm_started_.size() == kPlacesMax) warm_started_.pop_front();
    warm_started_.push_back(place);
  }
  if (!anew) return;
  const auto tool = [&](std::size_t k, double t) {
    const double after_s = t - body_->state().time_s;
    return ToolAt{from[k] + accelerated_distance(after_s) * inwards[k], accelerated_speed(after_s) * inwards[k]};
  };
  roll_out(kPressS, tool, [&](int, const Vector& x) { snapshot_cache_.keep(places, x); });
}

/// Of the snapshot cache, which then takes in the body as it is.
void StatePrediction::add_cached(const std::vector<std::size_t>& tools, std::vector<PredictedState>& predicted) {
  constexpr double kCachedWeight = 0.06, kCachedWeightBesideRollouts = 0.03;  // tuned: docs/notebook.md, 30, 53
  const double weight = predicted.empty() ? kCachedWeight : kCachedWeightBesideRollouts;
  if (body_->asleep()) warm_start(tools);
  std::vector<Vec3> near, holding;
  for (const std::size_t k : tools) near.push_back(frame_model_->place_of(body_->ports()[k]));
  for (const Vector* x : snapshot_cache_.most_informative(near, body_->state().x))
    predicted.push_back({SnapshotKind::cached, weight, *x});
  for (const ToolPort& port : body_->ports())
    if (port.kind == ContactKind::attach || port.touching) holding.push_back(frame_model_->place_of(port));
  if (!holding.empty()) snapshot_cache_.keep(holding, body_->state().x);
}

}  // namespace palpate
