#include "common/patch/sampled_tetrahedra.hpp"

#include <Eigen/Dense>
#include <cassert>
#include <vector>

#include "common/mechanics/polar.hpp"
#include "common/mechanics/viscosity.hpp"

namespace palpate {
namespace {

void square_of(const ElementLane (&m)[9], ElementLane& square) {
  square = m[0] * m[0];
  for (int i = 1; i < 9; ++i) square += m[i] * m[i];
}
void matrix_of(const ElementLane (&rows)[9], LaneMatrix<ElementLane>& m) {
  for (int i = 0; i < 9; ++i) m.of[i / 3][i % 3] = rows[i];
}

/// Returns the lane of each element: in order, triangles from the next group on; and the number of groups.
int lanes_of(const SampledElements& solid, std::vector<int>& lanes) {
  lanes.resize(static_cast<std::size_t>(solid.count()));
  int next = 0;
  for (const bool triangles : {false, true}) {
    next = (next + kSampledLanes - 1) / kSampledLanes * kSampledLanes;
    for (int e = 0; e < solid.count(); ++e)
      if (solid.is_triangle(e) == triangles) lanes[static_cast<std::size_t>(e)] = next++;
  }
  return (next + kSampledLanes - 1) / kSampledLanes;
}

}  // namespace

SampledSolidGroup::SampledSolidGroup(const LawParameters& law) : stamp(law) {
  const ElementLane none{};
  for (int i = 0; i < 9; ++i) {
    f.of[i / 3][i % 3] = none + (i % 4 == 0 ? 1.0F : 0.0F);
    df[i] = none;
  }
  viscous_mu = viscous_lambda = part = slope = none;
}

void SampledSolidGroup::move(const ElementLane (&change)[9]) noexcept {
  ElementLane square;
  square_of(change, square);
  for (int i = 0; i < 9; ++i) df[i] = change[i];
  free = !any_lane<ElementLane>(!(square <= kFreeGradient * kFreeGradient));
  if (free) return;
  ElementLane length;
  lane_roots(square, length);
  length = length > kFreeGradient ? length : ElementLane{} + kFreeGradient;
  const ElementLane away = kFurtherGradient / (length - kFreeGradient + kFurtherGradient);
  part = (kFreeGradient + (length - kFreeGradient) * away) / length;
  slope = away * away;
  for (ElementLane& entry : df) entry *= part;
}

void SampledSolidGroup::force(ElementLane (&q)[9]) const noexcept {
  constexpr float kSquareMin = 1e-20F;  // limit of |dF|^2, for lanes that do not move
  stamp.stress(df, q);
  if (free) return;
  ElementLane product = q[0] * df[0], square;
  for (int i = 1; i < 9; ++i) product += q[i] * df[i];
  square_of(df, square);
  const ElementLane along = (slope - part) * product / (square > kSquareMin ? square : ElementLane{} + kSquareMin);
  for (int i = 0; i < 9; ++i) q[i] = part * q[i] + along * df[i];
}

LaneMatrix<ElementLane> SampledSolidGroup::deformation() const noexcept {
  LaneMatrix<ElementLane> now = f;
  for (int i = 0; i < 9; ++i) now.of[i / 3][i % 3] += df[i];
  return now;
}

void SampledSolidGroup::damping(const ElementLane (&rate)[9], ElementLane (&q)[9]) const noexcept {
  LaneMatrix<ElementLane> motion, before{}, now{};
  matrix_of(rate, motion);
  add_viscous_stress(viscous_mu, viscous_lambda, f, motion, before);
  add_viscous_stress(viscous_mu, viscous_lambda, deformation(), motion, now);
  for (int i = 0; i < 9; ++i) q[i] = now.of[i / 3][i % 3] - before.of[i / 3][i % 3];
}

SampledSolidForce::SampledSolidForce(const SampledElements& solid, int tool, double step_s, bool slowed) {
  variables_ = tool + solid.motion.modes();
  const int m = solid.count();
  if (m == 0 || variables_ <= tool) return;
  assert(m <= kMaxFiniteElements && variables_ <= kMaxVariables && step_s > 0);
  const double stable = kStableStiffness / (step_s * step_s);
  const Eigen::MatrixXf h = solid.motions(tool);
  std::vector<int> lanes;
  const int groups = lanes_of(solid, lanes), modes = variables_ - tool;
  std::vector<Eigen::Matrix3d> deformations;
  for (int e = 0; e < m; ++e) {
    float volume = 0;
    const int k = lanes[static_cast<std::size_t>(e)] / kSampledLanes, lane = lanes[static_cast<std::size_t>(e)] % kSampledLanes;
    SampledSolidGroup& at = group(k);
    if (lane == 0) at = SampledSolidGroup(solid.is_triangle(e) ? LawParameters{SolidLaw::membrane, 0, {}, {}} : solid.law);
    const Eigen::Matrix3d f = solid.edges(solid.position, e).cast<double>() * solid.gradients(e, volume).cast<double>();
    for (int i = 0; i < 9; ++i) at.f.of[i / 3][i % 3][lane] = static_cast<float>(f(i / 3, i % 3));
    at.stamp.set(static_cast<std::size_t>(lane), f, static_cast<double>(solid.stiffness[e]),
                 static_cast<double>(solid.dilation[e]));
    at.viscous_mu[lane] = solid.damping[e] * solid.stiffness[e];
    at.viscous_lambda[lane] = solid.damping[e] * solid.dilation[e];
    damped_ |= solid.damping[e] > 0;
    deformations.push_back(f);
  }
  for (int k = 0; k < groups; ++k) group(k).stamp.linearise();
  Eigen::MatrixXd steepest = Eigen::MatrixXd::Zero(modes, modes);
  for (int e = 0; e < m; ++e) {
    const int k = lanes[static_cast<std::size_t>(e)] / kSampledLanes, lane = lanes[static_cast<std::size_t>(e)] % kSampledLanes;
    const Eigen::MatrixXd of_modes = h.block(9 * e, tool, 9, modes).cast<double>();
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> g = cofactors(deformations[static_cast<std::size_t>(e)]);
    const Eigen::RowVectorXd swelling = g.reshaped<Eigen::RowMajor>().transpose() * of_modes;
    const auto lambda = static_cast<double>(solid.dilation[e]);
    steepest += (group(k).stamp.deviatoric_bound(static_cast<std::size_t>(lane)) + lambda) * of_modes.transpose() * of_modes +
                2 * lambda * swelling.transpose() * swelling;
  }
  if (!steepest.allFinite()) return;
  const double s = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(steepest, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()[0];
  if (s > stable) {
    if (!slowed) return;
    added_mass_ = (1 / stable - 1 / s) * steepest;
  }
  lay_out(h, lanes, groups);
  move_to(Values::Zero(variables_));
}

void SampledSolidForce::add_dampers(int k, Square& dampers) const noexcept {
  // Rows whose squares sum to the power: the parts of the strain rate times the roots of their viscosities.
  constexpr int kRateRows = 7 * kSampledLanes;  // six strain rates and their trace, in every lane
  Eigen::Matrix<float, kRateRows, Eigen::Dynamic, Eigen::ColMajor, kRateRows, kMaxVariables> rows(kRateRows, variables_);
  const SampledSolidGroup& at = group(k);
  const LaneMatrix<ElementLane> f = at.deformation();
  ElementLane shear, twice, volume;
  lane_roots(at.viscous_mu, shear);
  lane_roots(2.0F * at.viscous_mu, twice);
  lane_roots(at.viscous_lambda, volume);
  for (int i = 0; i < variables_; ++i) {
    LaneMatrix<ElementLane> h, b;
    for (int n = 0; n < 9; ++n) load_lanes(motion(k, i) + kSampledLanes * n, h.of[n / 3][n % 3]);
    transposed_product(f, h, b);
    const ElementLane rates[7] = {twice * b.of[0][0],
                                  twice * b.of[1][1],
                                  twice * b.of[2][2],
                                  shear * (b.of[0][1] + b.of[1][0]),
                                  shear * (b.of[0][2] + b.of[2][0]),
                                  shear * (b.of[1][2] + b.of[2][1]),
                                  volume * (b.of[0][0] + b.of[1][1] + b.of[2][2])};
    for (int n = 0; n < 7; ++n) store_lanes(rates[n], rows.col(i).data() + kSampledLanes * n);
  }
  for (int i = 0; i < variables_; ++i)
    for (int j = 0; j <= i; ++j) {
      const float both = rows.col(i).dot(rows.col(j));
      dampers(i, j) += both;
      if (j < i) dampers(j, i) += both;
    }
}

}  // namespace palpate
