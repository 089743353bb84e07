#include "common/port/tetra_difference.hpp"

#include <algorithm>

#include "common/mechanics/polar.hpp"

namespace palpate {
namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Adds c q q^T, q row by row as a vector.
void add_product(double c, const Eigen::Matrix3d& q, Matrix9& a) {
  const Eigen::Matrix3d across = q.transpose();
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> row(across.data());
  a += c * row * row.transpose();
}

/// Adds dF M.
void add_matrix(const Eigen::Matrix3d& m, Matrix9& a) {
  for (int r = 0; r < 3; ++r) a.block<3, 3>(3 * r, 3 * r) += m;
}

/// Adds kappa X(F)[dF]: the derivative of each cofactor.
void add_cofactors(double kappa, const Eigen::Matrix3d& f, Matrix9& a) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int s = (r + 1) % 3, t = (r + 2) % 3, m = (c + 1) % 3, n = (c + 2) % 3;
      a(3 * r + c, 3 * s + m) += kappa * f(t, n);
      a(3 * r + c, 3 * t + n) += kappa * f(s, m);
      a(3 * r + c, 3 * t + m) -= kappa * f(s, n);
      a(3 * r + c, 3 * s + n) -= kappa * f(t, m);
    }
}

}  // namespace

TetraDifference::TetraDifference() {
  for (int i = 0; i < 3; ++i) f_.of[i][i] += 1.0;
}

double TetraDifference::set(int lane, const LawParameters& law, const Eigen::Matrix3d& deformation, double mu_l, double lambda) {
  const auto l = static_cast<std::size_t>(lane);
  Eigen::Matrix3d p = Eigen::Matrix3d::Zero();
  Matrix9 a = Matrix9::Zero();
  double shear = 0;
  energy_[l] = 0;
  mu_[l] = mu_l;
  lambda_[l] = lambda;
  if (law.kind == SolidLaw::ogden) {
    if (ogden_.sum == 0) ogden_ = OgdenLaw(law);
    const OgdenModuli moduli{mu_l, lambda};
    const OgdenTangent of = ogden_tangent(ogden_, moduli, deformation);
    p = ogden_stress(ogden_, moduli, deformation);
    energy_[l] = ogden_energy(ogden_, moduli, deformation);
    add_matrix(of.g_of_c, a);
    for (std::size_t k = 0; k < of.c.size(); ++k) add_product(of.c[k], of.q[k], a);
    add_product(lambda, cofactors(deformation), a);
    add_cofactors(of.kappa, deformation, a);
    shear += 0.5 * of.steepest;
  }
  if (law.fibres.share > 0) {
    const FibreStress of(law.fibres, law.fibres.share * mu_l, deformation);
    p += of.stress();
    energy_[l] += of.energy;
    add_matrix(of.pull * of.a * of.a.transpose(), a);
    add_product(2 * of.slope, of.along * of.a.transpose(), a);
    shear += 0.5 * std::max(0.0, of.pull) + of.slope * of.along.squaredNorm();
  }
  for (int i = 0; i < 9; ++i) {
    f_.of[i / 3][i % 3][l] = deformation(i / 3, i % 3);
    p_.of[i / 3][i % 3][l] = p(i / 3, i % 3);
  }
  std::size_t entry = 0;
  for (int i = 0; i < 9; ++i)
    for (int k = i; k < 9; ++k) a_[entry++][l] = a(i, k);
  return shear;
}

void TetraDifference::spread() {
  const auto all = [](Doubles<kTetraLane>& lane) { lane = Doubles<kTetraLane>{} + lane[0]; };
  for (Doubles<kTetraLane>* const lane : {&energy_, &mu_, &lambda_}) all(*lane);
  for (int i = 0; i < 9; ++i) {
    all(f_.of[i / 3][i % 3]);
    all(p_.of[i / 3][i % 3]);
  }
  for (Doubles<kTetraLane>& entry : a_) all(entry);
}

void TetraDifference::move(const TetraLanes& df, Mat<kTetraLane>& f, Mat<kTetraLane>& way) const noexcept {
  for (std::size_t i = 0; i < 9; ++i) {
    Doubles<kTetraLane>& entry = way.of[i / 3][i % 3];
    for (int l = 0; l < kTetraLane; ++l) entry[static_cast<std::size_t>(l)] = static_cast<double>(df[i][l]);
    f.of[i / 3][i % 3] = f_.of[i / 3][i % 3] + entry;
  }
}

void TetraDifference::along_tangent(const Mat<kTetraLane>& way, Mat<kTetraLane>& dp) const noexcept {
  dp = {};
  std::size_t entry = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    Doubles<kTetraLane>& own = dp.of[i / 3][i % 3];
    own += a_[entry++] * way.of[i / 3][i % 3];
    for (std::size_t k = i + 1; k < 9; ++k, ++entry) {
      own += a_[entry] * way.of[k / 3][k % 3];
      dp.of[k / 3][k % 3] += a_[entry] * way.of[i / 3][i % 3];
    }
  }
}

void TetraDifference::add_residual_stress(const LawParameters& law, const TetraLanes& df, TetraLanes& q) const noexcept {
  Mat<kTetraLane> f, way, p{}, dp;
  move(df, f, way);
  if (law.kind == SolidLaw::ogden) add_ogden<kTetraLane>(ogden_, mu_, lambda_, f, p);
  if (law.fibres.share > 0) add_fibres<kTetraLane>(law.fibres, law.fibres.share * mu_, f, p);
  along_tangent(way, dp);
  for (std::size_t i = 0; i < 9; ++i) {
    const Doubles<kTetraLane> more = p.of[i / 3][i % 3] - p_.of[i / 3][i % 3] - dp.of[i / 3][i % 3];
    for (int l = 0; l < kTetraLane; ++l) q[i][l] += static_cast<float>(more[static_cast<std::size_t>(l)]);
  }
}

TetraLane TetraDifference::residual_energy(const LawParameters& law, const TetraLanes& df) const noexcept {
  Mat<kTetraLane> f, way, dp;
  move(df, f, way);
  along_tangent(way, dp);
  Doubles<kTetraLane> there{}, first, second;
  if (law.kind == SolidLaw::ogden) ogden_energies<kTetraLane>(ogden_, mu_, lambda_, f, there);
  inner(p_, way, first);
  inner(dp, way, second);
  const Doubles<kTetraLane> more = there - energy_ - first - 0.5 * second;
  const Eigen::Map<const Eigen::Vector3d> a(law.fibres.direction.data());
  TetraLane energy;
  for (int l = 0; l < kTetraLane; ++l) {
    const auto lane = static_cast<std::size_t>(l);
    double sum = more[lane];
    if (law.fibres.share > 0) {
      Eigen::Matrix3d of_lane;
      for (int i = 0; i < 9; ++i) of_lane(i / 3, i % 3) = f.of[i / 3][i % 3][lane];
      sum += fibre_energy(law.fibres, law.fibres.share * mu_[lane], (of_lane * a).squaredNorm() - 1);
    }
    energy[l] = static_cast<float>(sum);
  }
  return energy;
}

}  // namespace palpate
