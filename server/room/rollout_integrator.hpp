// Integrator of rollouts for bodies whose own one keeps something from step to step, or takes hundreds of explicit steps
// (solids): TR-BDF2 in few long steps, by conjugate gradients, only as accurate as it takes to know which way a body bends.
//
// The cost is estimated from counted work, as the selection of the integrator does (integrator_selection.hpp); no clock is read:
//     edges of elements * (kIterationNs Newton iterations + kMatrixNs matrices + kProductNs products)
// in ns of one core, each of the three measured for an edge. An advance() is one step of TR-BDF2, unless that has to be cut.
//
// Failures: a step that does not converge, or for which no budget is left, ends the rollout; on a slower machine all takes longer
// than estimated.
// Source: TR-BDF2 (integrator.hpp), Bank, Coughran, Fichtner, Grosse, Rose and Smith, IEEE Trans. CAD 4 (1985).
#pragma once

#include "server/dynamics/integrator.hpp"

namespace palpate {

class RolloutIntegrator {
 public:
  /// `dynamics` and `skin` must outlive it.
  RolloutIntegrator(const Dynamics& dynamics, const Skin& skin);

  /// Begins a frame: nothing is spent.
  void begin() { spent_s_ = 0; }
  /// Sets the budget of the frame: the estimated cost of all its steps so far and to come, which the last of them may exceed.
  void allow(double most_s) { most_s_ = most_s; }
  /// Returns false, with a state of no use, if the budget is spent or `steps` more steps of the least cost would exceed it, or if
  /// the step does not converge.
  bool advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools, int steps);

 private:
  double edges_, most_s_ = 0, spent_s_ = 0;
  Integrator integrator_;
};

}  // namespace palpate
