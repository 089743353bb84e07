#include "server/body/settle.hpp"

#include <stdexcept>

namespace palpate {

BodyState settled_state(const Dynamics& dynamics, const Skin& skin) {
  BodyState state = dynamics.rest_state();
  if (dynamics.body().gravity_m_s2.squaredNorm() == 0) return state;
  constexpr double kStepS = 0.05, kStillM = 1e-9;
  constexpr int kStepsMax = 2000;
  Integrator integrator(dynamics, skin, {kStepS});
  std::vector<ToolPort> none;
  for (int k = 0; k < kStepsMax; ++k) {
    const Vector before = state.x;
    if (!integrator.advance(state, none, state.time_s + kStepS, {}).converged) break;
    state.v.setZero();
    if ((state.x - before).cwiseAbs().maxCoeff() > kStillM) continue;
    state.time_s = 0;
    return state;
  }
  throw std::runtime_error("the body finds no equilibrium in gravity: it is too soft, or not fixed anywhere");
}

}  // namespace palpate
