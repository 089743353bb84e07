// States that the body may be in until the next patches, for snapshots of their bases (snapshot_set.hpp): rollouts. The body is
// stepped on from its state x* over the mean prediction horizon tau of a frame, once for each of some motions of the hands, and
// x(t) at HandRollout::snapshots moments are the states. A tool at h* with velocity v is, t after the stamp
// (tool_prediction.hpp), at
//
//     dead_reckoned   h(t) = h* + v (t - t^2 / (2 T)), decelerating: as its track continues without samples
//     else            h(t) = h* + v t + a (t e - e^2 / 2),   e = min(t, kAccelerationTimeS);   at rest after kPredictionMostS
//
//     a = 0,  or a_h (accelerates),  or a_h + aside_m_s2;     a_h the present acceleration of the hand (SteppedBody::hand_motion)
//     presses         in addition, where it does not touch, d(t) into the surface (accelerated_distance())
//
// all hands at once in each. h [m], v [m/s], a [m/s^2]; of a grasp h is the position to which its node is led
// (tool_coupling.hpp). Where a tool does not touch, the hand that presses comes first, alone if the body sleeps: the body at rest
// does not show where a touch will take it. Where tau is below kPredictionMostS no hand turns aside.
//
// A rollout costs what the body costs over its time, c tau, c its cost by the selection of the integrator [s/s]; as many are run
// as fit into kFrameCostMostS, in the order of the table, none of a body with c > kBodyCostMax. Where the integrator keeps
// something from step to step, of solids, whose explicit steps are hundreds, and with c > kBodyCostMax under a tool of several
// spheres, which begin and end to touch within tau, TR-BDF2 takes one long step from snapshot to snapshot
// (rollout_integrator.hpp): the first rollout may cost kFirstCostMostS, the others are run for what it leaves of
// kFrameCostMostS. A rollout ends where a step does not converge or costs too much, with the states before. Tuned and measured:
// docs/notebook.md, 24, 26, 30, 33, 71.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "server/reduction/frame_model.hpp"
#include "server/room/rollout_integrator.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

class StatePrediction {
 public:
  /// `body` must outlive it.
  explicit StatePrediction(SteppedBody& body);
  /// Returns the states of a frame; none for a body that sleeps and is only touched.
  std::vector<PredictedState> states(Micros horizon);

 private:
  std::size_t affordable_rollouts(Micros horizon) const;
  void roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot);

  SteppedBody* body_;
  std::optional<RolloutIntegrator> long_steps_;
};

}  // namespace palpate
