#include "common/patch/lagged_damping.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cassert>

namespace palpate {

LaggedDamping::LaggedDamping(const SampledSolidForce& solid, const ModeMatrix& damping) {
  const Eigen::Index n = solid.variables();
  assert(damping.rows() <= n);
  Square sum = Square::Zero(n, n);
  for (int group = 0; group < solid.groups(); ++group) solid.add_dampers(group, sum);
  if (!(sum.trace() > 0) || !sum.allFinite()) return;
  at_stamp_ = sum;
  asked_.setZero(n, n);
  change_.setZero(n, n);
  damping_ = damping;
}

void LaggedDamping::renew(const SampledSolidForce& solid, const ModeMatrix& closing) noexcept {
  assert(closing.rows() == damping_.rows());
  if (next_ < solid.groups()) {
    solid.add_dampers(next_++, asked_);
    return;
  }
  const Eigen::Index r = damping_.rows();
  const auto holds = [&] {
    const ModeMatrix left = kTakenShareMax * damping_ + change_.bottomRightCorner(r, r);
    return Eigen::LLT<ModeMatrix>(left).info() == Eigen::Success;
  };
  change_ = (asked_ - at_stamp_).cast<double>();
  if (!holds()) change_ = asked_.cast<double>();
  asked_.setZero();
  next_ = 0;
  if (!change_.allFinite()) change_.setZero();  // for a motion that is not finite
  const ModeMatrix of_modes = change_.bottomRightCorner(r, r);
  ModeMatrix whole = closing * of_modes;
  whole.diagonal().array() += 1;
  closing_ = whole.partialPivLu().solve(closing);
}

}  // namespace palpate
