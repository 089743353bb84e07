// A body stepped in rollouts, where its own integrator keeps something from step to step and may not be asked, and solids, whose
// explicit steps are hundreds: TR-BDF2 in few long steps, by conjugate gradients, and no more exact than it takes to know which
// way a body bends.
//
// What that costs is estimated from what it took, as the selection of the integrator does (integrator_selection.hpp), and no
// clock is read:
//     edges of elements * (kIterationNs Newton's iterations + kMatrixNs matrices + kProductNs products)
//
// in ns of one core, each of the three measured for an edge. An advance() goes in one step of TR-BDF2, unless that has to be
// cut.
// What can go wrong: a step that does not converge, or has no budget left, ends the rollout; on a slower machine all takes
// longer than estimated.
// Source: of TR-BDF2 (integrator.hpp) Bank, Coughran, Fichtner, Grosse, Rose and Smith, IEEE Trans. CAD 4 (1985).
#pragma once

#include "server/body/integrator.hpp"

namespace palpate {

class RolloutIntegrator {
 public:
  /// `dynamics` and `skin` must outlive it.
  RolloutIntegrator(const Dynamics& dynamics, const Skin& skin);

  /// Sets a budget, estimated cost of the steps from here on, which the last of them may exceed. Returns true if `steps` steps
  /// of the mean cost so far fit into it.
  bool allow(double most_s, int steps);
  /// False where that is spent, where it would be by `steps` steps of the usual kind, or where the body is not to be followed:
  /// the state is of no use then.
  bool advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools, int steps);

 private:
  double edges_, left_s_ = 0;
  double taken_s_, steps_ = 1;  // by all so far, and one that is usual among bodies
  Integrator integrator_;
};

}  // namespace palpate
