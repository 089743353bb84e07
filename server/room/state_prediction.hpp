// States that the body may be in until the next patches, for snapshots of their bases (snapshot_set.hpp): rollouts of its hands
// (hand_rollouts.hpp), states that it was in before (snapshot_cache.hpp), and of a body at rest a warm-start indentation.
//
// A rollout costs what the body costs over its time, c tau, c its cost by the selection of the integrator [s/s]; as many are run
// as fit into kFrameCostMostS, none of a body with c > kBodyCostMax. Where the integrator cannot roll out, or takes more small
// steps than that is worth, rough steps are taken (rollout_integrator.hpp). Tuned and measured: docs/notebook.md, 24, 26, 30, 33.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "server/reduce/frame_model.hpp"
#include "server/room/rollout_integrator.hpp"
#include "server/room/snapshot_cache.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {

class StatePrediction {
 public:
  /// Both must outlive it.
  StatePrediction(SteppedBody& body, FrameModel& frame_model);
  /// Forgets everything: the body, or the hands on it, are others.
  void clear();
  /// For the patches of these tools, in a frame that has begun. None of rollouts where the likeliest does not get to its end.
  std::vector<PredictedState> states(const std::vector<std::size_t>& tools, Micros horizon);

 private:
  /// A rollout from where the body is: `snapshot` gets which of kRolloutSnapshots moments it is, and x; roughly, it gets
  /// kRoughRolloutSnapshots of them. As far as the steps converge; whether that is to the end.
  bool roll_out(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& snapshot);
  std::size_t affordable_rollouts(Micros horizon);
  std::vector<PredictedState> hand_rollouts(Micros horizon);
  void warm_start(const std::vector<std::size_t>& tools);
  void add_cached(const std::vector<std::size_t>& tools, std::vector<PredictedState>& predicted);

  SteppedBody* body_;
  FrameModel* frame_model_;
  std::optional<RolloutIntegrator> roughly_;
  SnapshotCache snapshot_cache_;
  std::deque<Vec3> warm_started_;  // places on the body at rest
};

}  // namespace palpate
