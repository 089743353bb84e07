#include "server/room/rollout_integrator.hpp"

#include <cassert>

namespace palpate {
namespace {

// Numbers in brackets: rows of docs/notebook.md.
constexpr double kIterationNs = 32, kMatrixNs = 80, kProductNs = 3.5, kStepNs = 200;  // of an edge; measured (33, 39)
constexpr double kToleranceEdges = 0.01;  // of a mean edge: which way a body bends, no more; a tenth of it gains nothing (33)
constexpr double kEventStepS = 0.01;      // measured: a finer one leaves time for fewer rollouts (39)
constexpr int kNewtonIterationsMax = 24;  // of a step; measured: grasps take two or three, touches to nine

}  // namespace

RolloutIntegrator::RolloutIntegrator(const Dynamics& dynamics, const Skin& skin)
    : edges_(static_cast<double>(edges_of(dynamics.body()).size())),
      integrator_(dynamics, skin,
                  {.tolerance_m = kToleranceEdges * mean_edge_m(dynamics.body()),
                   .solver = LinearSolver::Method::conjugate_gradients,
                   .event_step_s = kEventStepS,
                   .most_iterations = kNewtonIterationsMax}) {}

bool RolloutIntegrator::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools,
                                int steps) {
  assert(until_s > state.time_s && steps > 0);
  if (spent_s_ + 1e-9 * edges_ * kStepNs * steps > most_s_) return false;
  const AdvanceReport report = integrator_.advance(state, ports, until_s, until_s - state.time_s, tools);
  spent_s_ +=
      1e-9 * edges_ *
      (kIterationNs * report.newton_iterations + kMatrixNs * report.factorisations + kProductNs * report.solver_iterations);
  return report.converged;
}

}  // namespace palpate
