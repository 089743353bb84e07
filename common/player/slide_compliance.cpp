#include "common/player/slide_compliance.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>

#include "common/base/part_above.hpp"

namespace palpate {

SlideCompliance::SlideCompliance(const Patch& patch, const PortRows& rows, const Vec3& weight) : shared_(weight.squaredNorm()) {
  assert(rows.cols() == patch.modes() && shared_ > 0);
  ModeMatrix dynamic = kShift_1_s * patch.damping;
  dynamic.diagonal() += patch.stiffness + ModeVector::Constant(patch.modes(), kShift_1_s * kShift_1_s);
  whitening_ = ModeMatrix::Identity(patch.modes(), patch.modes());
  Eigen::LLT<ModeMatrix>(dynamic).matrixL().solveInPlace(whitening_);
  at_stamp_ = of_modes(rows);
  constexpr double kFloorShare = 1e-6;  // share of the trace: a planar body does not yield across its plane
  constexpr double kFloor_m_n = 1e-12;  // where nothing yields at all, which would leave no metric
  Mat3 whole = at_stamp_ + patch.c_static;
  whole.diagonal().array() += kFloorShare * whole.trace() + kFloor_m_n;
  root_ = whole.llt().matrixL();
  inverse_root_ = root_.inverse();
}

Mat3 SlideCompliance::of_modes(const PortRows& rows) const noexcept {
  assert(rows.cols() == whitening_.cols());
  ModePort white(rows.cols(), 3);
  white.noalias() = whitening_ * rows.transpose();
  return white.transpose() * white;
}

Mat3 SlideCompliance::grown(const Mat3& before, const Mat3& missing) noexcept { return before + part_above(missing - before, 0); }

Mat3 SlideCompliance::missing(const PortRows& rows, const Vec3& weight) const noexcept {
  const double rho = std::min(1.0, weight.squaredNorm() / shared_);
  const Mat3 share = inverse_root_ * (at_stamp_ - of_modes(rows) / rho) * inverse_root_.transpose();
  return rho * root_ * part_above(share, kMissingShareMin) * root_.transpose();
}

}  // namespace palpate
