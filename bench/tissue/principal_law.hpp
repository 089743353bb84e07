// The laws of solids in terms of principal stretches l_i, independent of the kernels (common/mechanics/laws.hpp), as the basis
// of closed forms. For an isotropic law of energy density Psi(l_1, l_2, l_3) [J/m^3] and F = U diag(l) V^T
//
//     P = U diag(dPsi/dl_i) V^T     first Piola-Kirchhoff stress [Pa]
//
//   corotational   Psi = mu sum (l_i - 1)^2 + lambda/2 (sum l_i - 3)^2
//   neo_hookean    Psi = mu/2 (I - 3 - ln((I + 1) / 4)) + lambda/2 ((J - alpha)^2 - (1 - alpha)^2),  I = sum l_i^2,
//                  J = l_1 l_2 l_3; mu, lambda, alpha from Lame's parameters as the kernel's header says
//   mooney_rivlin, veronda_westmann
//                  Psi = mu_1/(2 b) (exp(b I_1) - 1) + mu_2/2 I_2 + lambda/2 (J - 1)^2,  I_1 = I - 3 - 2 (J - 1),
//                  I_2 = sum (J / l_i)^2 - 3 - 4 (J - 1), for b I_1 < 4 (common/mechanics/solid_law.hpp)
//   ogden          Psi = sum_p 2 mu_L s_p / alpha_p^2 (sum l_i^alpha_p - 3) - mu_s (J - 1) + lambda/2 (J - 1)^2, in the range in
//                  which common/mechanics/ogden.hpp follows its powers
//   gent           Psi = -mu_L J_m/2 ln(1 - I_1 / J_m) + (lambda_L + mu_L)/2 (J - 1)^2,  for I_1 < 3/4 J_m
#pragma once

#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// Lame's parameters at small strains [Pa].
struct Lame {
  explicit Lame(const SolidMaterial& material);
  double mu, lambda;
};

double energy_density(const SolidMaterial& material, const Vec3& stretches);
/// dPsi/dl_i [Pa].
Vec3 principal_stress(const SolidMaterial& material, const Vec3& stretches);
/// P at any F of positive determinant.
Mat3 stress_at(const SolidMaterial& material, const Mat3& f);
/// dPsi/dI_1 [Pa] of a law that depends on I_1 alone at constant volume; throws std::logic_error for other laws.
double energy_by_first_invariant(const SolidMaterial& material, double first_invariant);

/// Every law that a scene may name, by its name, with 10 kPa and the given Poisson's ratio; `shape` is 0.3 for mooney_rivlin and
/// ogden, 2 for veronda_westmann, 3 for gent.
struct NamedLaw {
  std::string name;
  SolidMaterial material;
};
std::vector<NamedLaw> laws_at(double poisson);

}  // namespace palpate
