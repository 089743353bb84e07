// What a solid is made of, as scene, body, wire and patch name it: its law and what that has besides the two moduli of small
// strains, fibres, and the shares of stress that fade; with the pieces of the laws that body and player both compute.
//
// Equations, symbols and sources of the laws: server/body/tetra_kernel.hpp; of Ogden's and of fibres: ogden.hpp, fibre_lanes.hpp.
// Every law has the shear modulus mu_L and Lame's lambda_L in small strains, and no stress at rest. Bounds are those that a scene
// and a datagram are held to.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate {

/// Of a finite element (server/body/tetra_kernel.hpp). `membrane` is that of a triangle, others of what has a volume.
enum class SolidLaw : std::uint8_t { corotational, neo_hookean, mooney_rivlin, veronda_westmann, ogden, membrane };

/// What a law has besides its moduli of small strains: mooney_rivlin the share of the second invariant in the shear modulus, 0 to
/// kMaxSecondShare; veronda_westmann its exponent b, up to kMaxExponent; ogden the share of its second term; others nothing.
inline constexpr double kMaxSecondShare = 1, kMaxExponent = 50;
/// Of Ogden's exponents alpha_p, their size (common/port/ogden.hpp).
inline constexpr double kMinOgdenExponent = 1, kMaxOgdenExponent = 30;

/// Fibres that all run one way at rest (common/port/fibre_lanes.hpp).
struct Fibres {
  std::array<double, 3> direction{1, 0, 0};  ///< at rest, of length 1
  double share = 0;                          ///< k / mu_L; 0: there are none
  double exponent = 0;                       ///< b

  bool operator==(const Fibres&) const = default;
};
inline constexpr double kMaxFibreShare = 1e3;

/// A law with all but its moduli.
struct LawParameters {
  SolidLaw kind = SolidLaw::neo_hookean;
  double shape = 0;                   ///< see kMaxSecondShare
  std::array<double, 2> exponents{};  ///< of ogden: alpha_1, alpha_2
  Fibres fibres{};

  bool operator==(const LawParameters&) const = default;
};

/// Of a Prony series: the share of the stress of fast motions that fades, and the time in which it does
/// (server/body/relaxation.hpp).
struct PronyBranch {
  double share = 0, time_s = 1;
};
inline constexpr std::size_t kMaxPronyBranches = 4;
inline constexpr double kMaxFadingShare = 0.95;  ///< of all branches together
inline constexpr double kMinFadingS = 0.01, kMaxFadingS = 1e5;

/// mooney_rivlin and veronda_westmann: laws of both invariants, of one form (server/body/tetra_kernel.hpp).
inline constexpr bool is_of_invariants(SolidLaw law) {
  return law == SolidLaw::mooney_rivlin || law == SolidLaw::veronda_westmann;
}

/// That form's numbers [Pa, or what the moduli are in].
struct InvariantModuli {
  double mu_1, mu_2, lambda, exponent;
};
/// `mu_l`, `lambda_l`: Lame's parameters of small strains.
inline InvariantModuli invariant_moduli(SolidLaw law, double shape, double mu_l, double lambda_l) {
  const double mu_2 = law == SolidLaw::mooney_rivlin ? shape * mu_l : -mu_l, mu_1 = mu_l - mu_2;
  return {mu_1, mu_2, lambda_l + mu_1, law == SolidLaw::mooney_rivlin ? 0 : shape};
}

/// e(y): exp(y), followed along its tangent beyond kSteepest, so that no element stiffens without end.
inline constexpr double kSteepest = 4;
inline double growth(double y) {
  const double within = std::exp(std::min(y, kSteepest));
  return within * (1 + std::max(y - kSteepest, 0.0));
}
/// Its derivative.
inline double growth_slope(double y) { return std::exp(std::min(y, kSteepest)); }
/// Its integral from 0.
inline double growth_integral(double y) {
  const double within = std::expm1(std::min(y, kSteepest)), beyond = std::max(y - kSteepest, 0.0);
  return within + growth_slope(y) * beyond * (1 + beyond / 2);
}

}  // namespace palpate
