#include "server/elements/element_material.hpp"

#include <Eigen/Eigenvalues>
#include <cassert>
#include <cmath>

#include "server/elements/law_loops.hpp"

namespace palpate {
namespace {

using Pair = Lanes<double, 2>;

/// Returns F - `rest`, the first in one lane and the second in the other.
LaneMatrix<Pair> pair_of(const Mat3& first, const Mat3& second, double rest) {
  LaneMatrix<Pair> m;
  for (int k = 0; k < 9; ++k) {
    const double of_rest = k % 4 == 0 ? rest : 0;
    m.of[k / 3][k % 3] = Pair{first(k / 3, k % 3) - of_rest, second(k / 3, k % 3) - of_rest};
  }
  return m;
}
Mat3 lane_of(const LaneMatrix<Pair>& m, std::size_t lane) {
  return Mat3::NullaryExpr([&](Eigen::Index r, Eigen::Index c) { return m.of[r][c][lane]; });
}
LaneModuli<Pair> moduli_of(const ElementMaterial& m) { return {Pair{} + m.mu, Pair{} + m.lambda}; }

Tangent<Pair> tangents_at(const ElementMaterial& m, const Mat3& first, const Mat3& second, bool clamp) {
  Tangent<Pair> a;
  Variants<TangentLoop>::at<2>(*m.law, moduli_of(m), pair_of(first, second, 1), clamp, a);
  return a;
}

}  // namespace

ElementMaterial::ElementMaterial(const SolidMaterial& material)
    : law(std::make_shared<const Elasticity>(material.parameters())),
      kind(material.law),
      has_fibres(material.fibres.share > 0),
      damping_s(material.damping_s) {
  assert(material.young_pa > 0 && material.poisson > -1 && material.poisson < 0.5 && damping_s >= 0);
  const LameParameters lame = lame_parameters(material.law, material.young_pa, material.poisson);
  mu = lame.mu, lambda = lame.lambda;
}

std::array<double, 4> elastic_energy_densities(const ElementMaterial& m, const std::array<Mat3, 4>& f) {
  using Four = Lanes<double, 4>;
  LaneMatrix<Four> h;
  for (int k = 0; k < 9; ++k)
    for (std::size_t l = 0; l < 4; ++l) h.of[k / 3][k % 3][l] = f[l](k / 3, k % 3) - (k % 4 == 0 ? 1 : 0);
  Four psi;
  m.law->energy({Four{} + m.mu, Four{} + m.lambda}, h, psi);
  return {psi[0], psi[1], psi[2], psi[3]};
}

Mat3 elastic_stress(const ElementMaterial& m, const Mat3& f) {
  LaneMatrix<Pair> p{};
  Variants<StressLoop>::at<2>(*m.law, moduli_of(m), pair_of(f, f, 1), p);
  return lane_of(p, 0);
}

Mat9 elastic_tangent(const ElementMaterial& m, const Mat3& f, bool clamp) {
  const Tangent<Pair> a = tangents_at(m, f, f, clamp);
  return Mat9::NullaryExpr([&](Eigen::Index i, Eigen::Index k) { return a.at(static_cast<int>(i), static_cast<int>(k))[0]; });
}

void drop_negative_eigenvalues(double (&tangent)[45]) {
  const Mat9 a = Mat9::NullaryExpr([&](Eigen::Index i, Eigen::Index k) {
    return tangent[tangent_index(static_cast<int>(std::min(i, k)), static_cast<int>(std::max(i, k)))];
  });
  const Eigen::SelfAdjointEigenSolver<Mat9> eigen(a);
  const Mat9 without = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose();
  for (int i = 0; i < 9; ++i)
    for (int k = i; k < 9; ++k) tangent[tangent_index(i, k)] = without(i, k);
}

}  // namespace palpate
