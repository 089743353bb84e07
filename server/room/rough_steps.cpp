#include "server/room/rough_steps.hpp"

namespace palpate {
namespace {

constexpr double kIterationNs = 32, kMatrixNs = 80, kProductNs = 3.5, kStepNs = 350;  // of an edge; measured
constexpr double kTolerance = 0.01;                                                   // of an edge's length
constexpr int kMostIterations = 24;                                                   // of a step; grasps take two or three

}  // namespace

RoughSteps::RoughSteps(const Dynamics& dynamics, const Skin& skin)
    : edges_(static_cast<double>(edges_of(dynamics.body()).size())),
      integrator_(dynamics, skin,
                  {.tolerance_m = kTolerance * mean_edge_m(dynamics.body()),
                   .solver = LinearSolver::Method::conjugate_gradients,
                   .most_iterations = kMostIterations}) {}

bool RoughSteps::advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, const ToolMotion& tools, int steps) {
  if (1e-9 * edges_ * kStepNs * steps > left_s_) return false;
  const AdvanceReport report = integrator_.advance(state, ports, until_s, until_s - state.time_s, tools);
  left_s_ -=
      1e-9 * edges_ *
      (kIterationNs * report.newton_iterations + kMatrixNs * report.factorisations + kProductNs * report.solver_iterations);
  return report.converged;
}

}  // namespace palpate
