#include "server/operators/body_operator.hpp"

#include <cassert>

#include "server/solve/linear_solver.hpp"

namespace palpate {

bool WholeBody::factorises(const Dynamics& dynamics) {
  return LinearSolver::factorises(dynamics.nodes(), dynamics.body().planar);
}

Vector WholeBody::forces() const {
  assert(state_);
  Vector f;
  dynamics_->forces(*state_, f);
  return f;
}

bool WholeBody::assemble(double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp,
                         UpperBlocks& a) const {
  if (factorises(*dynamics_) || !tangents_.can_assemble()) return false;
  tangents_.assemble(c_m, c_d, c_k, held, clamp, a);
  return true;
}

CoarseSpace* WholeBody::coarse() {
  if (factorises(*dynamics_) || dynamics_->body().planar) return nullptr;
  if (!coarse_) coarse_.emplace(*dynamics_);
  return &*coarse_;
}

std::span<const CoarseSpace::Node> WholeBody::pieces() const {
  return coarse_ ? std::span<const CoarseSpace::Node>(coarse_->nodes()) : std::span<const CoarseSpace::Node>();
}

}  // namespace palpate
