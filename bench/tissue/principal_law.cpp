#include "bench/tissue/principal_law.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <stdexcept>

#include "server/scene/settings.hpp"

namespace palpate {
namespace {

/// Parameters of the neo-Hookean law that match Lame's at small strains.
struct Stable {
  explicit Stable(const SolidMaterial& material) {
    const Lame lame(material);
    mu = 4.0 / 3 * lame.mu;
    lambda = lame.lambda + 5.0 / 6 * lame.mu;
    alpha = 1 + 3 * mu / (4 * lambda);
  }
  double mu = 0, lambda = 0, alpha = 1;
};

/// Parameters of the laws of both invariants.
struct InvariantModuli {
  explicit InvariantModuli(const SolidMaterial& material) {
    const Lame lame(material);
    const bool mooney = material.law == SolidLaw::mooney_rivlin;
    mu_2 = mooney ? material.shape * lame.mu : -lame.mu;
    mu_1 = lame.mu - mu_2;
    lambda = lame.lambda + mu_1;
    exponent = mooney ? 0 : material.shape;
  }
  double mu_1, mu_2, lambda, exponent;
};

bool is_of_invariants(SolidLaw law) { return law == SolidLaw::mooney_rivlin || law == SolidLaw::veronda_westmann; }

/// s_p and alpha_p of Ogden's law, and mu_s.
struct OgdenNumbers {
  explicit OgdenNumbers(const SolidMaterial& material)
      : lame(material), share{1 - material.shape, material.shape}, alpha(material.exponents) {
    for (std::size_t p = 0; p < 2; ++p) sum += 2 * lame.mu * share[p] / alpha[p];
  }
  Lame lame;
  std::array<double, 2> share, alpha;
  double sum = 0;
  double lambda() const { return lame.lambda + sum; }
};

/// I_1 and I_2 minus their values at rest, and J.
struct StretchInvariants {
  explicit StretchInvariants(const Vec3& l)
      : j(l.prod()),
        first(l.squaredNorm() - 3 - 2 * (j - 1)),
        of_cofactors((j * l.cwiseInverse()).squaredNorm()),
        second(of_cofactors - 3 - 4 * (j - 1)) {}
  double j, first, of_cofactors, second;
};

}  // namespace

Lame::Lame(const SolidMaterial& material)
    : mu(material.young_pa / (2 * (1 + material.poisson))),
      lambda(material.young_pa * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))) {}

double energy_density(const SolidMaterial& material, const Vec3& l) {
  if (material.law == SolidLaw::corotational) {
    const Lame lame(material);
    const double trace = l.sum() - 3;
    return lame.mu * (l.array() - 1).square().sum() + lame.lambda / 2 * trace * trace;
  }
  if (is_of_invariants(material.law)) {
    const InvariantModuli law(material);
    const StretchInvariants at(l);
    const double grown = law.exponent > 0 ? std::expm1(law.exponent * at.first) / law.exponent : at.first;
    return law.mu_1 / 2 * grown + law.mu_2 / 2 * at.second + law.lambda / 2 * (at.j - 1) * (at.j - 1);
  }
  if (material.law == SolidLaw::ogden) {
    const OgdenNumbers law(material);
    const double more = l.prod() - 1;
    double sum = law.lambda() / 2 * more * more - law.sum * more;
    for (std::size_t p = 0; p < 2; ++p)
      sum += 2 * law.lame.mu * law.share[p] / (law.alpha[p] * law.alpha[p]) * (l.array().pow(law.alpha[p]).sum() - 3);
    return sum;
  }
  if (material.law == SolidLaw::gent) {
    const Lame lame(material);
    const StretchInvariants at(l);
    return -lame.mu * material.shape / 2 * std::log(1 - at.first / material.shape) +
           (lame.lambda + lame.mu) / 2 * (at.j - 1) * (at.j - 1);
  }
  const Stable law(material);
  const double i = l.squaredNorm(), apart = l.prod() - law.alpha, at_rest = 1 - law.alpha;
  return law.mu / 2 * (i - 3 - std::log((i + 1) / 4)) + law.lambda / 2 * (apart * apart - at_rest * at_rest);
}

Vec3 principal_stress(const SolidMaterial& material, const Vec3& l) {
  if (material.law == SolidLaw::corotational) {
    const Lame lame(material);
    return (2 * lame.mu * (l.array() - 1) + lame.lambda * (l.sum() - 3)).matrix();
  }
  if (is_of_invariants(material.law)) {
    const InvariantModuli law(material);
    const StretchInvariants at(l);
    const Vec3 dj = at.j * l.cwiseInverse();
    const Vec3 d_second = 2 * (at.of_cofactors - dj.array().square()).matrix().cwiseQuotient(l) - 4 * dj;
    return law.mu_1 * std::exp(law.exponent * at.first) * (l - dj) + law.mu_2 / 2 * d_second + law.lambda * (at.j - 1) * dj;
  }
  if (material.law == SolidLaw::ogden) {
    const OgdenNumbers law(material);
    Vec3 sum = (law.lambda() * (l.prod() - 1) - law.sum) * l.prod() * l.cwiseInverse();
    for (std::size_t p = 0; p < 2; ++p)
      sum += 2 * law.lame.mu * law.share[p] / law.alpha[p] * l.array().pow(law.alpha[p] - 1).matrix();
    return sum;
  }
  if (material.law == SolidLaw::gent) {
    const Lame lame(material);
    const StretchInvariants at(l);
    const Vec3 dj = at.j * l.cwiseInverse();
    return lame.mu / (1 - at.first / material.shape) * (l - dj) + (lame.lambda + lame.mu) * (at.j - 1) * dj;
  }
  const Stable law(material);
  const double j = l.prod();
  return law.mu * (1 - 1 / (l.squaredNorm() + 1)) * l + law.lambda * (j - law.alpha) * j * l.cwiseInverse();
}

Mat3 stress_at(const SolidMaterial& material, const Mat3& f) {
  const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * principal_stress(material, svd.singularValues()).asDiagonal() * svd.matrixV().transpose();
}

double energy_by_first_invariant(const SolidMaterial& material, double first_invariant) {
  if (material.law != SolidLaw::neo_hookean) throw std::logic_error("this law is not one of the first invariant");
  return Stable(material).mu / 2 * (1 - 1 / (first_invariant + 1));
}

std::vector<NamedLaw> laws_at(double poisson) {
  std::vector<NamedLaw> laws;
  for (std::size_t k = 0; k < kSolidLawNames.size(); ++k) {
    SolidMaterial material;
    material.law = static_cast<SolidLaw>(k);
    material.young_pa = 10e3;
    material.poisson = poisson;
    material.damping_s = 0;
    if (material.law == SolidLaw::mooney_rivlin) material.shape = 0.3;
    if (material.law == SolidLaw::veronda_westmann) material.shape = 2;
    if (material.law == SolidLaw::gent) material.shape = 3;
    if (material.law == SolidLaw::ogden) material.shape = 0.3, material.exponents = {5, -4};
    laws.push_back({kSolidLawNames[k], material});
  }
  return laws;
}

}  // namespace palpate
