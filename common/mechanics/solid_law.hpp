// The material of a solid, as named in scene, body, wire and patch: its law with parameters other than the two moduli of small
// strains, fibres, and the shares of stress that relax; with the parts of the laws that body and player both compute:
//
//     the exponential           e(y) = exp y up to Y = kLogGrowthMax, exp(Y) (1 + y - Y) beyond;  e';  h(y), its integral from 0
//     laws of both invariants   Psi = mu_1 / (2 b) h(b I_1) + mu_2 / 2 I_2 + lambda / 2 (J - 1)^2,  b = 0: mu_1 / 2 I_1 + ...
//                               mu_1 = mu_L - mu_2,  lambda = lambda_L + mu_1,  mu_2 = s mu_L (mooney_rivlin, b = 0, s a share)
//                               or -mu_L (veronda_westmann)
//
// Other equations, symbols and sources of the laws: server/dynamics/tetra_kernel.hpp; of Ogden's and of fibres: ogden.hpp,
// fibre_lanes.hpp. Every law has the shear modulus mu_L and Lame's lambda_L [Pa] in small strains, and no stress at rest. The
// bounds hold for scenes and for datagrams.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate {

/// Law of a finite element (server/dynamics/tetra_kernel.hpp). `membrane` is for triangles, the others for elements with a
/// volume.
enum class SolidLaw : std::uint8_t { corotational, neo_hookean, mooney_rivlin, veronda_westmann, ogden, gent, membrane };

/// Lame's parameters of small strains [Pa, or what E is in] from Young's modulus E and Poisson's ratio nu:
///     mu = E / (2 (1 + nu)),   lambda = E nu / ((1 + nu) (1 - 2 nu)), of a membrane (plane stress) E nu / (1 - nu^2).
struct LameParameters {
  double mu, lambda;
};
constexpr LameParameters lame_parameters(SolidLaw law, double young, double poisson) {
  const double of_volume = law == SolidLaw::membrane ? 1 - poisson * poisson : (1 + poisson) * (1 - 2 * poisson);
  return {young / (2 * (1 + poisson)), young * poisson / of_volume};
}

/// Parameter of a law besides its moduli of small strains: mooney_rivlin: share of the second invariant in the shear modulus, 0
/// to kMaxSecondShare; veronda_westmann: its exponent b, up to kMaxExponent; ogden: share of its second term; gent: its limit
/// J_m, from kMinGentLimit to kMaxGentLimit; others: none.
inline constexpr double kMaxSecondShare = 1, kMaxExponent = 50, kMinGentLimit = 0.01, kMaxGentLimit = 1000;
struct ShapeRange {
  double low, high;
};
constexpr ShapeRange shape_range(SolidLaw law) {
  if (law == SolidLaw::mooney_rivlin || law == SolidLaw::ogden) return {0, kMaxSecondShare};
  if (law == SolidLaw::veronda_westmann) return {0, kMaxExponent};
  if (law == SolidLaw::gent) return {kMinGentLimit, kMaxGentLimit};
  return {0, 0};
}
/// Limits of |alpha_p|, Ogden's exponents (common/mechanics/ogden.hpp).
inline constexpr double kMinOgdenExponent = 1, kMaxOgdenExponent = 30;

/// Fibres that all have one direction at rest (common/mechanics/fibres.hpp).
struct Fibres {
  std::array<double, 3> direction{1, 0, 0};  ///< at rest, of length 1
  double share = 0;                          ///< k / mu_L; 0: there are none
  double exponent = 0;                       ///< b

  bool operator==(const Fibres&) const = default;
};
inline constexpr double kMaxFibreShare = 1e3;  ///< limit of k / mu_L

/// A law with all parameters but its moduli.
struct LawParameters {
  SolidLaw kind = SolidLaw::neo_hookean;
  double shape = 0;                   ///< see kMaxSecondShare
  std::array<double, 2> exponents{};  ///< for ogden: alpha_1, alpha_2
  Fibres fibres{};

  bool operator==(const LawParameters&) const = default;
};

/// One branch of a Prony series: the share of the stress of fast motions that relaxes, and its time constant
/// (server/dynamics/relaxation.hpp).
struct PronyBranch {
  double share = 0, time_s = 1;
};
inline constexpr std::size_t kMaxPronyBranches = 4;  ///< each needs up to 50 bytes of a patch's 1200
inline constexpr double kMaxFadingShare = 0.95;      ///< all branches: fast motions are up to 20 times as stiff as slow ones
inline constexpr double kMinFadingS = 0.01;  ///< at least a body's step, once in which stress relaxes (docs/decisions/0065)
inline constexpr double kMaxFadingS = 1e5;   ///< a day; slower is practically never

/// mooney_rivlin and veronda_westmann: laws of both invariants, of one form (server/dynamics/tetra_kernel.hpp).
inline constexpr bool is_of_invariants(SolidLaw law) {
  return law == SolidLaw::mooney_rivlin || law == SolidLaw::veronda_westmann;
}

/// Parameters of that form [Pa, or the unit of the moduli].
struct InvariantModuli {
  double mu_1, mu_2, lambda, exponent;
};
/// `mu_l`, `lambda_l`: Lame's parameters of small strains.
inline InvariantModuli invariant_moduli(SolidLaw law, double shape, double mu_l, double lambda_l) {
  const double mu_2 = law == SolidLaw::mooney_rivlin ? shape * mu_l : -mu_l, mu_1 = mu_l - mu_2;
  return {mu_1, mu_2, lambda_l + mu_1, law == SolidLaw::mooney_rivlin ? 0 : shape};
}

/// e(y): exp(y), continued along its tangent beyond kLogGrowthMax, so that no element stiffens without bound.
inline constexpr double kLogGrowthMax = 4;  ///< 55 times as stiff as at rest; more: exact further, larger tangents
inline double growth(double y) {
  const double within = std::exp(std::min(y, kLogGrowthMax));
  return within * (1 + std::max(y - kLogGrowthMax, 0.0));
}
/// Derivative of growth().
inline double growth_slope(double y) { return std::exp(std::min(y, kLogGrowthMax)); }
/// Integral of growth() from 0.
inline double growth_integral(double y) {
  const double within = std::expm1(std::min(y, kLogGrowthMax)), beyond = std::max(y - kLogGrowthMax, 0.0);
  return within + growth_slope(y) * beyond * (1 + beyond / 2);
}

}  // namespace palpate
