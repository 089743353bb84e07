// The material of a solid, as named in scene, body, wire and patch: its law with parameters other than the two moduli of small
// strains, fibres, and the shares of stress that relax. The equations of each law stand in its own header (laws.hpp lists them).
// The bounds hold for scenes and for datagrams.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate {

/// Law of a finite element (laws.hpp). `membrane` is for triangles, the others for elements with a
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
/// (server/body/relaxation.hpp).
struct PronyBranch {
  double share = 0, time_s = 1;
};
inline constexpr std::size_t kMaxPronyBranches = 4;  ///< each needs up to 52 bytes of a patch's 1200
inline constexpr double kMaxFadingShare = 0.95;      ///< all branches: fast motions are up to 20 times as stiff as slow ones
inline constexpr double kMinFadingS = 0.01;  ///< at least a body's step, once in which stress relaxes (docs/decisions/0065)
inline constexpr double kMaxFadingS = 1e5;   ///< a day; slower is practically never

/// y from which the exponential of a law, e(y) = exp y, continues along its tangent, so that no element stiffens without bound:
/// 55 times as stiff as at rest; more: exact further, larger tangents.
inline constexpr double kLogGrowthMax = 4;
/// Returns the integral of e from 0.
inline double growth_integral(double y) {
  const double end = std::min(y, kLogGrowthMax), beyond = y - end;
  return std::expm1(end) + std::exp(end) * beyond * (1 + beyond / 2);
}

}  // namespace palpate
