#include "common/mechanics/ogden.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>

namespace palpate {
namespace {

using One = Lanes<double, 2>;  // the smallest vector: one F, the same in both lanes

}  // namespace

Ogden::Ogden(const LawParameters& law) {
  const std::array<double, 2> shares{1 - law.shape, law.shape};
  for (std::size_t p = 0; p < terms_.size(); ++p) {
    if (shares[p] == 0) continue;
    OgdenTerm& term = terms_[p];
    assert(std::abs(law.exponents[p]) >= kMinOgdenExponent && std::abs(law.exponents[p]) <= kMaxOgdenExponent);
    term.weight = 2 * shares[p] / law.exponents[p];
    term.power = law.exponents[p] / 2 - 1;
    term.low = kSquaredStretchMin;
    term.high = kSquaredStretchMax;
    if (term.power < 0) term.low = std::max(term.low, std::exp(kLogGrowthMax / term.power));
    if (term.power > 0) term.high = std::min(term.high, std::exp(kLogGrowthMax / term.power));
    term.log_low = std::log(term.low);
    term.log_high = std::log(term.high);
    sum_ += term.weight;
  }
}

void Ogden::tangent_of_one(double mu, double lambda, const double (&h)[9], double* entries) const {
  const Eigen::Matrix3d f =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h) + Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(f.transpose() * f);
  const Eigen::Vector3d squares = eigen.eigenvalues().cwiseMax(0.0);
  const Eigen::Matrix3d &v = eigen.eigenvectors(), y = f * v;
  Eigen::Vector3d g = Eigen::Vector3d::Zero(), slope = g, between = g;  // between[i]: of the two others
  One x[3], log_x[3];
  for (int i = 0; i < 3; ++i) x[i] = One{} + squares[i];
  log_squares(x, log_x);
  for (const OgdenTerm& term : terms_) {
    if (term.weight == 0) continue;
    OgdenTermAt<One> at;
    find_term(term, x, log_x, at);
    for (int i = 0; i < 3; ++i) {
      One way, first;
      LaneTruths<One> near;
      first_difference(term, x, at, (i + 1) % 3, (i + 2) % 3, way, near, first);
      g[i] += mu * at.value[i][0];
      slope[i] += mu * at.slope[i][0];
      between[i] += mu * first[0];
    }
  }
  const auto lanes = [](const Eigen::Matrix3d& m, LaneMatrix<One>& of) {
    for (int k = 0; k < 9; ++k) of.of[k / 3][k % 3] = One{} + m(k / 3, k % 3);
  };
  Tangent<One> a;
  a.clear();
  LaneMatrix<One> part, cofactor;
  lanes(v * g.asDiagonal() * v.transpose(), part);
  a.add_right(part);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    lanes(y.col(i) * v.col(i).transpose(), part);
    a.add_outer(One{} + 2 * slope[i], part);
    lanes(y.col(j) * v.col(k).transpose() + y.col(k) * v.col(j).transpose(), part);
    a.add_outer(One{} + between[i], part);
  }
  const double of_volume = lambda + sum_ * mu;
  lanes(f, part);
  cofactors(part, cofactor);
  a.add_outer(One{} + of_volume, cofactor);
  a.add_cofactors(One{} + (of_volume * (f.determinant() - 1) - sum_ * mu), part);
  for (int k = 0; k < Tangent<One>::kEntries; ++k) entries[k] = a.of[k][0];
}

}  // namespace palpate
