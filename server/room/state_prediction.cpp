#include "server/room/state_prediction.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <span>

namespace palpate {
namespace {

struct HandRollout {
  bool dead_reckoned = false, accelerates = false;
  Vec3 aside_m_s2 = Vec3::Zero();
  int snapshots = 1;  ///< of the prediction horizon, evenly, the last at its end
  double weight = 1;  ///< of the snapshots
};

constexpr std::size_t kRolloutsLeast = 2;       // whatever they cost: one alone lost up to 13 dB (docs/notebook.md, 24)
constexpr std::size_t kUndeviatedRollouts = 3;  // the first, in which no hand turns aside
constexpr int kSnapshots = 12;                  // 3 miss what swings within the horizon (docs/notebook.md, 25)
constexpr int kLongSteps = 6;                   // one a snapshot; 12 take twice as long (docs/notebook.md, 33)

/// In order of worth: most bodies are touched from above. Tuned: docs/notebook.md, 26.
const std::array<HandRollout, 6> kHandRollouts{
    {{.dead_reckoned = true, .snapshots = kSnapshots},
     {.snapshots = kSnapshots},
     {.accelerates = true, .snapshots = 2},
     {.accelerates = true, .aside_m_s2 = {0, 0, kHandAccelerationMs2}, .weight = 0.5},
     {.accelerates = true, .aside_m_s2 = {kHandAccelerationMs2, 0, 0}, .weight = 0.5},
     {.accelerates = true, .aside_m_s2 = {0, kHandAccelerationMs2, 0}, .weight = 0.5}}};

}  // namespace

StatePrediction::StatePrediction(SteppedBody& body) : body_(&body) {
  if (!body.integrator().stepper->is_stateless() || body.dynamics().body().is_solid())
    long_steps_.emplace(body.dynamics(), body.skin());
}

std::vector<PredictedState> StatePrediction::states(Micros horizon) {
  if (body_->asleep()) return {};
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
      return moved_on(now[k], rollout.accelerates ? Vec3(acceleration[k] + rollout.aside_m_s2) : Vec3(Vec3::Zero()),
                      t - body_->state().time_s);
    };
    const bool to_its_end = roll_out(seconds(horizon), tool, [&](int snapshot, const Vector& x) {
      if (snapshot * rollout.snapshots % kSnapshots != 0) return;
      const bool end = snapshot == kSnapshots && rollout.aside_m_s2.isZero(0);
      ahead.push_back({end ? SnapshotKind::rollout_end : SnapshotKind::rollout, rollout.weight, x});
    });
    // Without the likeliest states, the others count for less than the states before, whose place in the basis they would take.
    if (rollout.dead_reckoned && !to_its_end) return {};
  }
  return ahead;
}

/// Returns how many rollouts fit into kFrameCostMostS by estimate. Long steps count what they took.
std::size_t StatePrediction::affordable_rollouts(Micros horizon) {
  constexpr double kBodyCostMax = 0.01;       // so a horizon of 0.2 s costs 2 ms a rollout at most
  constexpr double kFrameCostMostS = 0.0125;  // a quarter of a frame at 20 Hz
  std::size_t rollouts = seconds(horizon) < kPredictionMostS ? kUndeviatedRollouts : kHandRollouts.size();
  if (long_steps_) return long_steps_->allow(kFrameCostMostS, kLongSteps) ? rollouts : 0;
  if (body_->integrator().cost > kBodyCostMax) return 0;
  const double each_s = body_->integrator().cost * seconds(horizon);
  while (rollouts > kRolloutsLeast && static_cast<double>(rollouts) * each_s > kFrameCostMostS) --rollouts;
  return rollouts;
}

/// Steps a copy of the body. `snapshot` gets the number of the moment, up to kSnapshots, and x. Returns false if a step does not
/// converge.
bool StatePrediction::roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot) {
  assert(over_s > 0);
  BodyState next = body_->state();
  std::vector<ToolPort> ports = body_->ports();
  const int moments = long_steps_ ? kLongSteps : kSnapshots;
  for (int k = 1; k <= moments; ++k) {
    const double until_s = body_->state().time_s + k * over_s / moments;
    if (!(long_steps_ ? long_steps_->advance(next, ports, until_s, tool, moments + 1 - k)
                      : body_->integrator().stepper->advance(next, ports, until_s, body_->integrator().step_s, tool).converged))
      return false;
    snapshot(k * (kSnapshots / moments), next.x);
  }
  return true;
}

}  // namespace palpate
