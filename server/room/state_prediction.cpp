#include "server/room/state_prediction.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <span>

namespace palpate {
namespace {

struct HandRollout {
  bool dead_reckoned = false, presses = false, accelerates = false;
  Vec3 aside_m_s2 = Vec3::Zero();
  int snapshots = 1;  ///< of the prediction horizon, evenly, the last at its end
  double weight = 1;  ///< of the snapshots
};

constexpr std::size_t kRolloutsLeast = 2;       // whatever they cost: one alone lost up to 13 dB (docs/notebook.md, 24)
constexpr std::size_t kUndeviatedRollouts = 3;  // the first, in which no hand turns aside
constexpr int kSnapshots = 12;                  // 3 miss what swings within the horizon (docs/notebook.md, 25)
constexpr int kLongSteps = 6;                   // one a snapshot; 12 take twice as long (docs/notebook.md, 33)
constexpr double kFirstCostMostS = 0.05;    // of the first in long steps: a frame at 20 Hz, by estimate (docs/notebook.md, 71)
constexpr double kFrameCostMostS = 0.0125;  // of all: a quarter of a frame at 20 Hz
constexpr double kBodyCostMax = 0.01;       // so a horizon of 0.2 s costs 2 ms a rollout at most

/// Comes first where a tool does not touch.
const HandRollout kPress{.presses = true, .snapshots = kSnapshots};

/// In order of worth: most bodies are touched from above. Tuned: docs/notebook.md, 26, 71.
const std::array<HandRollout, 6> kHandRollouts{
    {{.snapshots = kSnapshots},
     {.dead_reckoned = true, .snapshots = kSnapshots},
     {.accelerates = true, .snapshots = 2},
     {.accelerates = true, .aside_m_s2 = {0, 0, kHandAccelerationMs2}, .weight = 0.5},
     {.accelerates = true, .aside_m_s2 = {kHandAccelerationMs2, 0, 0}, .weight = 0.5},
     {.accelerates = true, .aside_m_s2 = {0, kHandAccelerationMs2, 0}, .weight = 0.5}}};

/// A tool, or a sphere of one, now. `inwards`: unit vector into the surface where the tool does not touch, else zero.
struct Hand {
  ToolAt now;
  Vec3 acceleration = Vec3::Zero(), inwards = Vec3::Zero();
};

/// Returns the point of the surface that is nearest to a tool that does not touch: to one of its spheres.
SurfacePoint nearest_of(const SteppedBody& body, std::uint32_t tool, const std::vector<double>& surface) {
  SurfacePoint nearest;
  double least_m = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k < body.ports().size(); ++k) {
    const ToolPort& port = body.ports()[k];
    if (port.tool != tool || port.kind != ContactKind::touch || port.needle.part == NeedlePart::shaft) continue;
    const Vec3 there = position_at(body.skin().view(), surface, port.point);
    const double apart_m = (body.tool(k, body.time()).position - there).norm() - port.sphere.radius_m;
    if (apart_m < least_m) least_m = apart_m, nearest = port.point;
  }
  return nearest;
}

std::vector<Hand> hands_of(const SteppedBody& body) {
  std::vector<Hand> hands;
  std::vector<double> surface;
  for (std::size_t k = 0; k < body.ports().size(); ++k) {
    const ToolPort& port = body.ports()[k];
    if (port.needle.part == NeedlePart::shaft) {
      hands.push_back(hands.back());  // that of its tip
      continue;
    }
    Hand& hand = hands.emplace_back(body.tool(k, body.time()), body.hand_motion(k).acceleration);
    const auto touches = [&](const ToolPort& other) { return other.tool == port.tool && other.touching; };
    if (port.kind != ContactKind::touch || std::ranges::any_of(body.ports(), touches) || body.skin().empty()) continue;
    if (surface.empty()) surface = body.skin().place(body.state().x);
    hand.inwards = -normal_at(body.skin().view(), surface, nearest_of(body, port.tool, surface));
  }
  return hands;
}

/// Returns the tool `after_s` from now. `dead_reckoned`: where its track has it then.
ToolAt moved(const HandRollout& rollout, const Hand& hand, const ToolAt& dead_reckoned, double after_s) {
  ToolAt tool = dead_reckoned;
  if (!rollout.dead_reckoned) {
    tool = moved_on(hand.now, rollout.accelerates ? Vec3(hand.acceleration + rollout.aside_m_s2) : Vec3(Vec3::Zero()), after_s);
    tool.axis = dead_reckoned.axis;
    tool.edge = dead_reckoned.edge;
  }
  if (rollout.presses) {
    tool.position += accelerated_distance(after_s) * hand.inwards;
    tool.velocity += accelerated_speed(after_s) * hand.inwards;
  }
  return tool;
}

}  // namespace

StatePrediction::StatePrediction(SteppedBody& body) : body_(&body) {
  const Scene& scene = body.scene();
  const auto has_several = [](const ToolSpec& tool) { return tool.shape.size() > 1; };
  const bool unaffordable =
      body.integrator().cost > kBodyCostMax && (has_several(scene.tool) || std::ranges::any_of(scene.tools, has_several));
  if (!body.integrator().stepper->is_stateless() || body.dynamics().body().is_solid() || unaffordable)
    long_steps_.emplace(body.dynamics(), body.skin());
}

std::vector<PredictedState> StatePrediction::states(Micros horizon) {
  const std::vector<Hand> hands = hands_of(*body_);
  std::vector<HandRollout> rollouts;
  if (std::any_of(hands.begin(), hands.end(), [](const Hand& hand) { return !hand.inwards.isZero(0); })) rollouts = {kPress};
  if (!body_->asleep())
    rollouts.insert(rollouts.end(), kHandRollouts.begin(),
                    kHandRollouts.begin() + (seconds(horizon) < kPredictionMostS ? kUndeviatedRollouts : kHandRollouts.size()));
  rollouts.resize(std::min(rollouts.size(), affordable_rollouts(horizon)));
  if (long_steps_) long_steps_->begin();
  std::vector<PredictedState> ahead;
  for (std::size_t k = 0; k < rollouts.size(); ++k) {
    const HandRollout& rollout = rollouts[k];
    const auto tool = [&](std::size_t port, double t) {
      return moved(rollout, hands[port], body_->tool(port, from_seconds(t)), t - body_->state().time_s);
    };
    if (long_steps_) long_steps_->allow(k == 0 ? kFirstCostMostS : kFrameCostMostS);
    roll_out(seconds(horizon), tool, [&](int snapshot, const Vector& x) {
      if (snapshot * rollout.snapshots % kSnapshots != 0) return;
      const bool end = snapshot == kSnapshots && rollout.aside_m_s2.isZero(0);
      ahead.push_back({end ? SnapshotKind::rollout_end : SnapshotKind::rollout, rollout.weight, x});
    });
  }
  return ahead;
}

/// Returns how many rollouts fit into kFrameCostMostS by estimate. Long steps count what they take.
std::size_t StatePrediction::affordable_rollouts(Micros horizon) const {
  std::size_t rollouts = kHandRollouts.size() + 1;
  if (long_steps_) return rollouts;
  if (body_->integrator().cost > kBodyCostMax) return 0;
  const double each_s = body_->integrator().cost * seconds(horizon);
  while (rollouts > kRolloutsLeast && static_cast<double>(rollouts) * each_s > kFrameCostMostS) --rollouts;
  return rollouts;
}

/// Steps a copy of the body until a step does not converge. `snapshot` gets the number of the moment, up to kSnapshots, and x.
void StatePrediction::roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot) {
  assert(over_s > 0);
  BodyState next = body_->state();
  std::vector<ToolPort> ports = body_->ports();
  const int moments = long_steps_ ? kLongSteps : kSnapshots;
  for (int k = 1; k <= moments; ++k) {
    const double until_s = body_->state().time_s + k * over_s / moments;
    if (!(long_steps_ ? long_steps_->advance(next, ports, until_s, tool, moments + 1 - k)
                      : body_->integrator().stepper->advance(next, ports, until_s, body_->integrator().step_s, tool).converged))
      return;
    snapshot(k * (kSnapshots / moments), next.x);
  }
}

}  // namespace palpate
