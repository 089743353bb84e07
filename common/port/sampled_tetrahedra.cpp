#include "common/port/sampled_tetrahedra.hpp"

#include <Eigen/Dense>
#include <cassert>
#include <vector>

namespace palpate {
namespace {

// Sums that stay in registers from one variable to the next, unlike those of Eigen.
using LaneVector = float __attribute__((vector_size(sizeof(TetraLane))));
using Lane __attribute__((may_alias, aligned(alignof(TetraLane)))) = LaneVector;
static_assert(alignof(Lane) == alignof(TetraLane), "where Eigen keeps its arrays less strictly than vectors, lanes are read so");
Lane* lanes(float* at) { return reinterpret_cast<Lane*>(at); }
const Lane* lanes(const float* at) { return reinterpret_cast<const Lane*>(at); }

TetraLanes lanes_of(const float* at) {
  TetraLanes m;
  for (std::size_t i = 0; i < 9; ++i) m[i] = Eigen::Map<const TetraLane>(at + kTetraLane * i);
  return m;
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
  if (is_triangle(tetrahedron)) {
    const Eigen::Matrix<double, 3, 2> sides = edges.leftCols<2>();
    Eigen::Matrix3d rows = Eigen::Matrix3d::Zero();
    rows.topRows<2>() = (sides.transpose() * sides).inverse() * sides.transpose();
    volume = static_cast<float>(edges.col(0).cross(edges.col(1)).norm());
    return rows.cast<float>();
  }
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
    : variables_(tool + solid.motion.modes()) {
  const int m = solid.count();
  if (m == 0 || variables_ <= tool) return;
  assert(m <= kMaxTetrahedra && variables_ <= kMaxVariables && step_s > 0);
  const double stable = SampledForce::kStableStiffness / (step_s * step_s);
  Eigen::MatrixXf h = solid.motions(tool);
  // elements in order, triangles from the next register on
  std::vector<int> place(static_cast<std::size_t>(m));
  int next = 0;
  for (const bool triangles : {false, true}) {
    next = (next + kTetraLane - 1) / kTetraLane * kTetraLane;
    for (int e = 0; e < m; ++e)
      if (solid.is_triangle(e) == triangles) place[static_cast<std::size_t>(e)] = next++;
  }
  const int count = (next + kTetraLane - 1) / kTetraLane, modes = variables_ - tool;
  Eigen::MatrixXd steepest = Eigen::MatrixXd::Zero(modes, modes);
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    group_[k].stamp = ElementLinearisation();
    group_[k].turned = ElementRotation();
    group_[k].viscous_mu = group_[k].viscous_lambda = TetraLane::Zero();
  }
  for (int e = 0; e < m; ++e) {
    float volume = 0;
    const Eigen::Matrix3d b = solid.gradients(e, volume).cast<double>();
    Eigen::Matrix3d edges;
    for (int i = 0; i < 3; ++i)
      edges.col(i) = (solid.position.col(solid.nodes(i + 1, e)) - solid.position.col(solid.nodes(0, e))).cast<double>();
    const Eigen::Matrix3d f = edges * b;
    const auto shear = static_cast<double>(solid.shear[e]), dilation = static_cast<double>(solid.dilation[e]);
    const int at_place = place[static_cast<std::size_t>(e)];
    Group& group = group_[static_cast<std::size_t>(at_place / kTetraLane)];
    ElementLinearisation& at = group.stamp;
    const int lane = at_place % kTetraLane;
    const LawParameters law = solid.is_triangle(e) ? LawParameters{SolidLaw::membrane, 0, {}, {}} : solid.law;
    const Eigen::Matrix3d frame = frame_of(law.kind, f);
    at.set(lane, law, frame.transpose() * f, shear, dilation);
    if (law.kind == SolidLaw::corotational)
      for (int i = 0; i < 3; ++i) {  // the columns of dF
        auto column = h(Eigen::seqN(9 * e + i, 3, 3), Eigen::all);
        column = frame.transpose().cast<float>() * Eigen::MatrixXf(column);
      }
    const auto t = static_cast<double>(solid.damping_s[e]);
    group.viscous_mu[lane] = static_cast<float>(t * shear);
    group.viscous_lambda[lane] = static_cast<float>(t * dilation);
    damped_ |= t > 0;

    const Eigen::MatrixXd of_modes = h.block(9 * e, tool, 9, modes).cast<double>();
    Eigen::RowVectorXd swelling = Eigen::RowVectorXd::Zero(modes);
    for (int i = 0; i < 9; ++i) swelling += static_cast<double>(at.g[static_cast<std::size_t>(i)][lane]) * of_modes.row(i);
    const auto mu = static_cast<double>(at.shear[lane]), lambda = static_cast<double>(at.lambda[lane]);
    steepest += (2 * mu + lambda) * of_modes.transpose() * of_modes + 2 * lambda * swelling.transpose() * swelling;
  }
  if (!steepest.allFinite()) return;
  const double s = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(steepest, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()[0];
  if (s > stable) {
    if (!slowed) return;
    added_mass_ = (1 / stable - 1 / s) * steepest;
  }
  groups_ = count;
  motion_.setZero(9 * kTetraLane, groups_ * variables_);
  for (int e = 0; e < m; ++e)
    for (int v = 0; v < variables_; ++v)
      for (int i = 0; i < 9; ++i) {
        const int at = place[static_cast<std::size_t>(e)];
        motion_(kTetraLane * i + at % kTetraLane, at / kTetraLane * variables_ + v) = h(9 * e + i, v);
      }
  move_to(Values::Zero(variables_));
}

void SampledSolidForce::moved(int group, const Values& u, TetraLanes& to) const noexcept {
  Lane df[9] = {};
  for (int v = 0; v < variables_; ++v) {
    const float by = u[v];
    const Lane* const h = lanes(motion(group, v));
#pragma GCC unroll 9
    for (int i = 0; i < 9; ++i) df[i] += by * h[i];
  }
#pragma GCC unroll 9
  for (std::size_t i = 0; i < 9; ++i) *lanes(to[i].data()) = df[i];
}

void SampledSolidForce::collect(int group, const TetraLanes& f, Sums& sums) const noexcept {
  Lane q[9];
#pragma GCC unroll 9
  for (std::size_t i = 0; i < 9; ++i) q[i] = *lanes(f[i].data());
  for (int v = 0; v < variables_; ++v) {
    const Lane* const h = lanes(motion(group, v));
    *lanes(sums[static_cast<std::size_t>(v)].data()) += ((h[0] * q[0] + h[1] * q[1]) + (h[2] * q[2] + h[3] * q[3])) +
                                                        ((h[4] * q[4] + h[5] * q[5]) + (h[6] * q[6] + h[7] * q[7])) + h[8] * q[8];
  }
}

SampledSolidForce::Values SampledSolidForce::total(const Sums& sums) const noexcept {
  Values g(variables_);
  for (int v = 0; v < variables_; ++v) g[v] = sums[static_cast<std::size_t>(v)].sum();
  return g;
}

void SampledSolidForce::move_to(const Values& u) noexcept {
  for (int k = 0; k < groups_; ++k) {
    Group& at = group_[static_cast<std::size_t>(k)];
    moved(k, u, at.df);
    const TetraLane square = inner(at.df, at.df);
    at.free = (square <= kFreeGradient * kFreeGradient).all();
    if (!at.free) {
      const TetraLane length = square.sqrt().max(kFreeGradient),
                      away = kFurtherGradient / (length - kFreeGradient + kFurtherGradient);
      at.part = (kFreeGradient + (length - kFreeGradient) * away) / length;
      at.slope = away.square();
      at.df = scaled(at.part, at.df);
    }
    turn(at.stamp, at.df, at.turned);
  }
}

void SampledSolidForce::gradient(Values& g) const noexcept {
  constexpr float kSquareMin = 1e-20F;  // limit of |dF|^2, for lanes that do not move
  Sums sums;
  sums.fill(TetraLane::Zero());
  for (int k = 0; k < groups_; ++k) {
    const Group& at = group_[static_cast<std::size_t>(k)];
    TetraLanes q = nonlinear_residual_stress(at.stamp, at.df, at.turned);
    if (!at.free) {
      const TetraLane along = (at.slope - at.part) * inner(q, at.df) / inner(at.df, at.df).max(kSquareMin);
      for (std::size_t i = 0; i < 9; ++i) q[i] = at.part * q[i] + along * at.df[i];
    }
    collect(k, q, sums);
  }
  g = total(sums);
}

double SampledSolidForce::energy() const noexcept {
  double sum = 0;
  for (int k = 0; k < groups_; ++k) {
    const Group& at = group_[static_cast<std::size_t>(k)];
    sum += nonlinear_residual_energy(at.stamp, at.df, at.turned).cast<double>().sum();
  }
  return sum;
}

void SampledSolidForce::damping(const Values& rate, Values& change, Values& at_stamp) const noexcept {
  at_stamp.setZero(variables_);
  change.setZero(variables_);
  if (!damped_) return;
  Sums sums;
  sums.fill(TetraLane::Zero());
  for (int k = 0; k < groups_; ++k) {
    const Group& at = group_[static_cast<std::size_t>(k)];
    TetraLanes motion;
    moved(k, rate, motion);
    const TetraLanes before = viscous_stress(at.viscous_mu, at.viscous_lambda, at.stamp.f, motion);
    TetraLanes more = viscous_stress(at.viscous_mu, at.viscous_lambda, sum(at.stamp.f, at.df), motion);
    for (std::size_t i = 0; i < 9; ++i) more[i] -= before[i];
    collect(k, more, sums);
  }
  change = total(sums);
}

void SampledSolidForce::add_dampers(int group, Square& dampers) const noexcept {
  // Rows whose squares sum to the power: the parts of the strain rate times the roots of their viscosities.
  constexpr int kRateRows = 7 * kTetraLane;  // six strain rates and their trace, in every lane
  Eigen::Matrix<float, kRateRows, Eigen::Dynamic, Eigen::ColMajor, kRateRows, kMaxVariables> rows(kRateRows, variables_);
  const Group& at = group_[static_cast<std::size_t>(group)];
  const TetraLanes f = sum(at.stamp.f, at.df);
  const TetraLane shear = at.viscous_mu.sqrt(), twice = (2 * at.viscous_mu).sqrt(), volume = at.viscous_lambda.sqrt();
  for (int i = 0; i < variables_; ++i) {
    const TetraLanes b = transposed_product(f, lanes_of(motion(group, i)));
    auto column = rows.col(i);
    column.segment<kTetraLane>(0) = twice * b[0];
    column.segment<kTetraLane>(kTetraLane) = twice * b[4];
    column.segment<kTetraLane>(2 * kTetraLane) = twice * b[8];
    column.segment<kTetraLane>(3 * kTetraLane) = shear * (b[1] + b[3]);
    column.segment<kTetraLane>(4 * kTetraLane) = shear * (b[2] + b[6]);
    column.segment<kTetraLane>(5 * kTetraLane) = shear * (b[5] + b[7]);
    column.segment<kTetraLane>(6 * kTetraLane) = volume * (b[0] + b[4] + b[8]);
  }
  for (int i = 0; i < variables_; ++i)
    for (int j = 0; j <= i; ++j) {
      const float both = rows.col(i).dot(rows.col(j));
      dampers(i, j) += both;
      if (j < i) dampers(j, i) += both;
    }
}

}  // namespace palpate
