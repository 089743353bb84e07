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

  /// Sets a budget: the estimated cost of all steps from here on, which the last of them may exceed. Returns true if `steps`
  /// steps of the mean cost so far fit into it.
  bool allow(double most_s, int steps);
  /// Returns false, with a state of no use, if the budget is spent or `steps` steps of the usual cost would exceed it, or if the
  /// step does not converge.
  bool advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools, int steps);

 private:
  double edges_, left_s_ = 0;
  double taken_s_, steps_ = 1;  // of all steps so far, and one of the usual cost among bodies
  Integrator integrator_;
};

}  // namespace palpate
