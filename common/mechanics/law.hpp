// The interface of a law of elasticity: a class that adds its stress and its tangent in every lane of a vector.
//
//     Psi(F) [J/m^3],   P = dPsi/dF [Pa],   A = dP/dF [Pa],   as functions of H = F - 1
//
// F deformation gradient (3 x 3), G its cofactors, J its determinant, X(F)[dF] the change of G with dF. Every law has the shear
// modulus mu_L and Lame's lambda_L in small strains, no stress at rest, and finite P and A for every F, flat and inside out.
//
//     struct Law {
//       static constexpr SolidLaw kKind;          // its name in scenes and patches (solid_law.hpp)
//       static constexpr bool kSinglePrecision;   // L may have floats: nothing in add_stress() cancels
//       explicit Law(const LawParameters&);
//       void energy(const LaneModuli<L>&, const LaneMatrix<L>& h, L& psi) const;
//       void add_stress(const LaneModuli<L>&, const LaneMatrix<L>& h, LaneMatrix<L>& p) const;
//       void add_tangent(const LaneModuli<L>&, const LaneMatrix<L>& h, Tangent<L>& a) const;
//     };
//
// laws.hpp lists them. Moduli may be multiplied by a volume or a thickness; energy, stress and tangent then are too.
#pragma once

#include "common/mechanics/lanes.hpp"
#include "common/mechanics/solid_law.hpp"
#include "common/mechanics/tangent.hpp"

namespace palpate {

/// mu_L and lambda_L.
template <typename L>
struct LaneModuli {
  L mu, lambda;
};

}  // namespace palpate
