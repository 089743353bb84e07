#include "common/port/sampled_tetrahedra.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

TetraLanes lanes_of(const float* from, Eigen::Index stride) {
  TetraLanes m;
  for (Eigen::Index i = 0; i < 9; ++i) m[static_cast<std::size_t>(i)] = Eigen::Map<const TetraLane>(from + i * stride);
  return m;
}

/// |dF|, no less than what rounding leaves of nothing, and phi / |dF|.
struct Bounded {
  TetraLane length, part;
};
Bounded bounded(const TetraLanes& df) {
  constexpr float kNothing = 1e-20F, kFree = SampledSolidForce::kFree, kBeyond = SampledSolidForce::kBeyond;
  const TetraLane length = inner(df, df).sqrt().max(kNothing), beyond = (length - kFree).max(0.0F);
  return {length, (length.min(kFree) + kBeyond * beyond / (beyond + kBeyond)) / length};
}

TetraLanes scaled(const TetraLane& by, const TetraLanes& m) {
  TetraLanes s;
  for (std::size_t i = 0; i < 9; ++i) s[i] = by * m[i];
  return s;
}

}  // namespace

GradientMotion gradient_motion(const Eigen::Matrix3f& gradients, const std::array<Eigen::Matrix3Xf, 3>& edges) {
  GradientMotion h = GradientMotion::Zero(9, edges[0].cols());
  for (int i = 0; i < 3; ++i)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) h.row(3 * r + c) += gradients(i, c) * edges[static_cast<std::size_t>(i)].row(r);
  return h;
}

Eigen::Matrix3f SampledTetrahedra::gradients(int tetrahedron, float& volume) const {
  Eigen::Matrix3d edges;
  for (int i = 0; i < 3; ++i)
    edges.col(i) = (rest.col(nodes(i + 1, tetrahedron)) - rest.col(nodes(0, tetrahedron))).cast<double>();
  volume = static_cast<float>(edges.determinant());
  return edges.inverse().cast<float>();
}

Eigen::MatrixXf SampledTetrahedra::motions(int tool) const {
  const Eigen::MatrixXf v = motion.rows(tool);
  Eigen::MatrixXf h(9 * count(), v.cols());
  for (int e = 0; e < count(); ++e) {
    float volume = 0;
    std::array<Eigen::Matrix3Xf, 3> edges;
    for (int i = 0; i < 3; ++i)
      edges[static_cast<std::size_t>(i)] = v.middleRows<3>(3 * nodes(i + 1, e)) - v.middleRows<3>(3 * nodes(0, e));
    h.middleRows<9>(9 * e) = gradient_motion(gradients(e, volume), edges);
  }
  return h;
}

SampledSolidForce::SampledSolidForce(const SampledTetrahedra& solid, int tool, double step_s, bool slowed)
    : law_(solid.law), variables_(tool + solid.motion.modes()) {
  const int m = solid.count();
  if (m == 0 || variables_ <= tool) return;
  const double stable = SampledForce::kStiffest / (step_s * step_s);
  const Eigen::MatrixXf h = solid.motions(tool);
  const int count = (m + kTetraLane - 1) / kTetraLane * kTetraLane, modes = variables_ - tool;
  Eigen::MatrixXd steepest = Eigen::MatrixXd::Zero(modes, modes);
  for (std::size_t group = 0; group < static_cast<std::size_t>(count / kTetraLane); ++group) {
    stamp_[group] = TetraStamp();
    viscous_mu_[group] = viscous_lambda_[group] = TetraLane::Zero();
  }
  for (int e = 0; e < m; ++e) {
    float volume = 0;
    const Eigen::Matrix3d b = solid.gradients(e, volume).cast<double>();
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i)
      edges.col(i) = (solid.position.col(solid.nodes(i + 1, e)) - solid.position.col(solid.nodes(0, e))).cast<double>();
    const Eigen::Matrix3d f = edges * b;
    const auto shear = static_cast<double>(solid.shear[e]), dilation = static_cast<double>(solid.dilation[e]);
    TetraStamp& at = stamp_[static_cast<std::size_t>(e / kTetraLane)];
    const int lane = e % kTetraLane;
    at.set(lane, law_, f, shear, dilation);
    const auto t = static_cast<double>(solid.damping_s[e]);
    viscous_mu_[static_cast<std::size_t>(e / kTetraLane)][lane] = static_cast<float>(t * shear);
    viscous_lambda_[static_cast<std::size_t>(e / kTetraLane)][lane] = static_cast<float>(t * dilation);
    damped_ |= t > 0;

    const Eigen::MatrixXd of_modes = h.block(9 * e, tool, 9, modes).cast<double>();
    Eigen::RowVectorXd swelling = Eigen::RowVectorXd::Zero(modes);
    for (int i = 0; i < 9; ++i) swelling += static_cast<double>(at.g[static_cast<std::size_t>(i)][lane]) * of_modes.row(i);
    const auto mu = static_cast<double>(at.mu[lane]), lambda = static_cast<double>(at.lambda[lane]);
    steepest += (2 * mu + lambda) * of_modes.transpose() * of_modes + 2 * lambda * swelling.transpose() * swelling;
  }
  if (!steepest.allFinite()) return;
  const double s = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(steepest, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()[0];
  if (s > stable) {
    if (!slowed) return;
    added_mass_ = (1 / stable - 1 / s) * steepest;
  }
  count_ = count;
  motion_.setZero(9 * count_, variables_);
  for (int i = 0; i < 9; ++i) motion_.middleRows(i * count_, m) = h(Eigen::seqN(i, m, 9), Eigen::all);
}

SampledSolidForce::Nine SampledSolidForce::moved(const Values& u) const noexcept {
  Nine df(count_, 9);
  Eigen::Map<Eigen::VectorXf>(df.data(), df.size()).noalias() = motion_ * u;
  return df;
}

SampledSolidForce::Values SampledSolidForce::collect(const Nine& f) const noexcept {
  Values g(variables_);
  g.noalias() = motion_.transpose() * Eigen::Map<const Eigen::VectorXf>(f.data(), f.size());
  return g;
}

void SampledSolidForce::gradient(const Values& u, Values& g) const noexcept {
  Nine all = moved(u);
  for (int e = 0; e < count_; e += kTetraLane) {
    const TetraLanes df = lanes_of(all.data() + e, count_);
    const Bounded at = bounded(df);
    TetraLanes q = stress_beyond_linear(law_, stamp_[static_cast<std::size_t>(e / kTetraLane)], scaled(at.part, df));
    // phi' = (kBeyond / (r - kFree + kBeyond))^2 beyond kFree, 1 before it.
    const TetraLane slope = (kBeyond / ((at.length - kFree).max(0.0F) + kBeyond)).square();
    const TetraLane along = (slope - at.part) * inner(q, df) / at.length.square();
    for (std::size_t i = 0; i < 9; ++i)
      all.col(static_cast<Eigen::Index>(i)).segment<kTetraLane>(e) = at.part * q[i] + along * df[i];
  }
  g = collect(all);
}

double SampledSolidForce::energy(const Values& u) const noexcept {
  const Nine all = moved(u);
  double sum = 0;
  for (int e = 0; e < count_; e += kTetraLane) {
    const TetraLanes df = lanes_of(all.data() + e, count_);
    sum += energy_beyond_linear(law_, stamp_[static_cast<std::size_t>(e / kTetraLane)], scaled(bounded(df).part, df))
               .cast<double>()
               .sum();
  }
  return sum;
}

void SampledSolidForce::damping(const Values& u, const Values& rate, Values& change, Values& at_stamp) const noexcept {
  at_stamp.setZero(variables_);
  change.setZero(variables_);
  if (!damped_) return;
  const Nine there = moved(u);
  Nine all = moved(rate);
  for (int e = 0; e < count_; e += kTetraLane) {
    const auto k = static_cast<std::size_t>(e / kTetraLane);
    TetraLanes f = lanes_of(there.data() + e, count_);
    const TetraLanes motion = lanes_of(all.data() + e, count_);
    const TetraLane part = bounded(f).part;
    const TetraLanes before = viscous_stress(viscous_mu_[k], viscous_lambda_[k], stamp_[k].f, motion);
    for (std::size_t i = 0; i < 9; ++i) f[i] = stamp_[k].f[i] + part * f[i];
    const TetraLanes now = viscous_stress(viscous_mu_[k], viscous_lambda_[k], f, motion);
    for (std::size_t i = 0; i < 9; ++i) all.col(static_cast<Eigen::Index>(i)).segment<kTetraLane>(e) = now[i] - before[i];
  }
  change = collect(all);
}

void SampledSolidForce::add_dampers(const Values& u, int group, Square& dampers) const noexcept {
  // Rows whose squares add up to the power: the strain rate's parts times the roots of what they are braked with.
  constexpr int kRows = 7 * kTetraLane;
  Eigen::Matrix<float, kRows, Eigen::Dynamic, Eigen::ColMajor, kRows, kMaxVariables> rows(kRows, variables_);
  const auto k = static_cast<std::size_t>(group);
  const Eigen::Index first = group * kTetraLane;
  const auto motion = [&](Eigen::Index variable) { return lanes_of(motion_.col(variable).data() + first, count_); };
  TetraLanes f;
  f.fill(TetraLane::Zero());
  for (int i = 0; i < variables_; ++i) {
    const TetraLanes h = motion(i);
    for (std::size_t j = 0; j < 9; ++j) f[j] += u[i] * h[j];
  }
  const TetraLane part = bounded(f).part;
  for (std::size_t j = 0; j < 9; ++j) f[j] = stamp_[k].f[j] + part * f[j];
  const TetraLane shear = viscous_mu_[k].sqrt(), twice = (2 * viscous_mu_[k]).sqrt(), volume = viscous_lambda_[k].sqrt();
  for (int i = 0; i < variables_; ++i) {
    const TetraLanes b = transposed_product(f, motion(i));
    auto column = rows.col(i);
    column.segment<kTetraLane>(0) = twice * b[0];
    column.segment<kTetraLane>(kTetraLane) = twice * b[4];
    column.segment<kTetraLane>(2 * kTetraLane) = twice * b[8];
    column.segment<kTetraLane>(3 * kTetraLane) = shear * (b[1] + b[3]);
    column.segment<kTetraLane>(4 * kTetraLane) = shear * (b[2] + b[6]);
    column.segment<kTetraLane>(5 * kTetraLane) = shear * (b[5] + b[7]);
    column.segment<kTetraLane>(6 * kTetraLane) = volume * (b[0] + b[4] + b[8]);
  }
  dampers.noalias() += rows.transpose() * rows;
}

}  // namespace palpate
