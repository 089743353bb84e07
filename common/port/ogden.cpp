#include "common/port/ogden.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/mechanics/polar.hpp"

namespace palpate {
namespace {

constexpr std::size_t kLanesOfOne = 2;  // smallest width of a vector (doubles.hpp): one F, the same in both lanes

Mat<kLanesOfOne> in_lanes(const Eigen::Matrix3d& f) {
  Mat<kLanesOfOne> m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m.of[r][c] = Doubles<kLanesOfOne>{} + f(r, c);
  return m;
}

}  // namespace

OgdenLaw::OgdenLaw(const LawParameters& law) {
  assert(law.kind == SolidLaw::ogden);
  const std::array<double, 2> shares{1 - law.shape, law.shape};
  for (std::size_t p = 0; p < terms.size(); ++p) {
    if (shares[p] == 0) continue;
    PortOgdenTerm& term = terms[p];
    assert(std::abs(law.exponents[p]) >= kMinOgdenExponent && std::abs(law.exponents[p]) <= kMaxOgdenExponent);
    term.weight = 2 * shares[p] / law.exponents[p];
    term.power = law.exponents[p] / 2 - 1;
    term.low = kPortSquaredStretchMin;
    term.high = kPortSquaredStretchMax;
    if (term.power < 0) term.low = std::max(term.low, std::exp(kLogGrowthMax / term.power));
    if (term.power > 0) term.high = std::min(term.high, std::exp(kLogGrowthMax / term.power));
    term.log_low = std::log(term.low);
    term.log_high = std::log(term.high);
    sum += term.weight;
  }
}

double ogden_energy(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f) {
  Doubles<kLanesOfOne> energy;
  ogden_energies<kLanesOfOne>(law, Doubles<kLanesOfOne>{} + moduli.mu, Doubles<kLanesOfOne>{} + moduli.lambda, in_lanes(f),
                              energy);
  return energy[0];
}

Eigen::Matrix3d ogden_stress(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f) {
  Mat<kLanesOfOne> p{};
  add_ogden<kLanesOfOne>(law, Doubles<kLanesOfOne>{} + moduli.mu, Doubles<kLanesOfOne>{} + moduli.lambda, in_lanes(f), p);
  Eigen::Matrix3d stress;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) stress(r, c) = p.of[r][c][0];
  return stress;
}

OgdenPrincipal ogden_principal(const OgdenLaw& law, double mu, const Eigen::Vector3d& x) {
  Doubles<kLanesOfOne> of[3], log_of[3];
  for (int i = 0; i < 3; ++i) of[i] = Doubles<kLanesOfOne>{} + x[i];
  log_squares<kLanesOfOne>(of, log_of);
  OgdenPrincipal out{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (const PortOgdenTerm& term : law.terms) {
    if (term.weight == 0) continue;
    PortOgdenTermAt<kLanesOfOne> at;
    find_term<kLanesOfOne>(term, of, log_of, at);
    for (int i = 0; i < 3; ++i) {
      Doubles<kLanesOfOne> way, first;
      Truths<kLanesOfOne> near;
      first_difference<kLanesOfOne>(term, of, at, (i + 1) % 3, (i + 2) % 3, way, near, first);
      out.g[i] += mu * at.value[i][0];
      out.slope[i] += mu * at.slope[i][0];
      out.between[i] += mu * first[0];
    }
  }
  return out;
}

OgdenTangent ogden_tangent(const OgdenLaw& law, OgdenModuli moduli, const Eigen::Matrix3d& f) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(f.transpose() * f);
  const Eigen::Vector3d x = eigen.eigenvalues().cwiseMax(0.0);
  const Eigen::Matrix3d &v = eigen.eigenvectors(), y = f * v;
  const OgdenPrincipal at = ogden_principal(law, moduli.mu, x);
  OgdenTangent out;
  out.g_of_c = v * at.g.asDiagonal() * v.transpose();
  out.kappa = moduli.lambda * (f.determinant() - 1) - law.sum * moduli.mu;
  constexpr double kCofactorsChange = 2 * std::numbers::inv_sqrt3;  // |X(F)| <= 2 / sqrt(3) |F|, with equality for multiples of 1
  double most = at.g.cwiseAbs().maxCoeff() + std::abs(out.kappa) * kCofactorsChange * f.norm();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const auto own = static_cast<std::size_t>(i), pair = static_cast<std::size_t>(i + 3);
    out.c[own] = 2 * at.slope[i];
    out.q[own] = y.col(i) * v.col(i).transpose();
    out.c[pair] = at.between[i];
    out.q[pair] = y.col(j) * v.col(k).transpose() + y.col(k) * v.col(j).transpose();
    most += std::max(0.0, out.c[own]) * x[i] + std::max(0.0, out.c[pair]) * (x[j] + x[k]);
  }
  out.steepest = most;
  return out;
}

}  // namespace palpate
