// The force of one linear tetrahedron of a solid beyond its linear force, in every lane of a vector (server/body/tetra_kernel.hpp
// has the laws).
//
// With F the deformation gradient at the stamp and F' = F + dF, its stress beyond the linear one is, without a difference of
// numbers that nearly cancel, Q = P(F') - P(F) - A(F) dF =
//
// stable neo-Hookean, G the cofactors of F, s = |F|^2 + 1, J = det F, Psi = mu/2 (|F|^2 - 3 - ln(s / 4)) + lambda/2 (J -
// alpha)^2:
//     mu [ d / (s (s + d)) dF + (q s - 2 f d) / (s^2 (s + d)) F ] + lambda [ j (X + C) + e G ] + lambda (J - alpha) C
//     f = F : dF,  q = |dF|^2,  d = 2 f + q,  C = cofactors of dF,  X = d(cofactors)/dF [dF]
//     e = F : C + det dF,  j = G : dF + e
// and its energy beyond the second order
//     mu/2 (z - ln(1 + z) - (2 f / s)^2 / 2) + lambda/2 e (2 j - e) + lambda (J - alpha) det dF,   z = d / s
//
// mooney_rivlin and veronda_westmann (mu_1, mu_2, lambda, e of tetra_kernel.hpp), with what stands above and I_1's change delta =
// d - 2 j, D = mu_1 (e(b I_1 + b delta) - e(b I_1)), s = mu_1 b e'(b I_1), R = D - s delta:
//     D (dF - X - C) + [R + s (q - 2 e)] (F - G) + mu_2 [X(F)[C] + X(dF)[X + C]] + lambda [ j (X + C) + e G ]
//         + [lambda (J - 1) - mu_1 e(b I_1) - 2 mu_2] C
// and its energy beyond the second order
//     mu_1/2 (h(delta) - e delta) - s delta^2 / 4 + s (q - 2 e)(2 delta - q + 2 e) / 4 + mu_2/2 (2 X : C + |C|^2)
//         + lambda/2 e (2 j - e) + [lambda (J - 1) - mu_1 e(b I_1) - 2 mu_2] det dF,
// h the integral of e over I_1 from the stamp to there
//
// corotational, in its own frame, in which R, the rotation of F, is 1 and F symmetric (frame_of()); R' that of F', c = tr F - 3,
// Psi = mu |F - R|^2 + lambda/2 c^2:
//     (lambda c - 2 mu) (R' - 1 - [W t]x) + lambda [ e R' + r (R' - 1) ]
//     W = ((tr F) 1 - F)^-1 (pairs of principal stretches that add to less than kLeastPairSum count as that), t the axial part of
//     dF;  r = tr dF,  e = (R' - 1) : F'
// and its energy beyond the second order
//     (lambda c / 2 - mu) (2 e - [W t]x : dF) + lambda/2 e (e + 2 r)
// R' is the rotation with the largest tr(R'^T F') like the body's own (polar_lanes.hpp), however far an element has rotated since
// the stamp and inside out too. Newton's method (3. there; R'^T F' - F = (R' - 1)^T F' + dF) finds it from an R' nearby, and it
// is the right one if the sums of two principal stretches are all above 0; where that fails it is found anew from F'.
//
// membrane, X = (F^T dF + dF^T F)/2, Y = dF^T dF / 2, S(E) = 2 mu E + lambda tr(E) 1 in the plane:
//     F S(Y) + dF S(X + Y)
// and its energy beyond the second order
//     S(X) : Y + S(Y) : Y / 2
//
// ogden, and the fibres of any law: by a difference (tetra_difference.hpp)
//
// Its viscous stress is P_v(F, F_t) = F (mu_v (B + B^T) + lambda_v tr(B) 1), B = F^T F_t.
#pragma once

#include <optional>

#include "common/port/tetra_difference.hpp"

namespace palpate {

/// Returns R: a corotational tetrahedron is given in this frame, dF as R^T dF, and its Q as R Q. 1 where the law needs none.
Eigen::Matrix3d frame_of(SolidLaw law, const Eigen::Matrix3d& deformation);

/// Rotation of a corotational tetrahedron since the stamp.
struct ElementRotation {
  std::array<TetraLane, 4> q;  ///< w, x, y, z of R'
  TetraLanes d;                ///< R' - 1

  /// No rotation.
  ElementRotation();
};
/// A tetrahedron of one material at a deformation gradient, in every lane its own.
struct ElementLinearisation {
  TetraLanes f, g;       ///< F; G, for a corotational one 1
  TetraLanes w;          ///< W for a corotational one
  TetraLane size;        ///< s, for a corotational one c, for laws of both invariants b I_1
  TetraLane mu, lambda;  ///< moduli of the law, times the tetrahedron's weight and volume [J]
  TetraLane pressure;    ///< lambda (J - alpha), corotational: lambda c - 2 mu, both invariants: the factor of C
  TetraLane mu_2, exponent, growth, slope;  ///< for laws of both invariants: mu_2 [J], b, e, mu_1 b e' [J]
  TetraLane shear;                          ///< mu of the bound of its tangent's stiffness (sampled_tetrahedra.hpp) [J]
  LawParameters law;
  std::optional<TetraDifference> difference;  ///< for ogden, and for fibres

  /// A tetrahedron without stiffness.
  ElementLinearisation();
  /// Sets a lane. `deformation` in its frame, in which its fibres run along F a. `mu_l`, `lambda_l`: Lame's parameters of small
  /// strains. All lanes have the same law.
  void set(int lane, const LawParameters& law, const Eigen::Matrix3d& deformation, double mu_l, double lambda_l);
  /// Copies lane 0 to all lanes.
  void spread();
};

/// Updates the rotation to dF, from the stamp or better from a little before; no effect where the law does not rotate.
void turn(const ElementLinearisation& at, const TetraLanes& df, ElementRotation& turned) noexcept;
/// Return Q, and the energy beyond the second order. `turned`: rotation at dF.
TetraLanes nonlinear_residual_stress(const ElementLinearisation& at, const TetraLanes& df,
                                     const ElementRotation& turned) noexcept;
TetraLane nonlinear_residual_energy(const ElementLinearisation& at, const TetraLanes& df, const ElementRotation& turned) noexcept;

/// Returns P_v.
TetraLanes viscous_stress(const TetraLane& mu, const TetraLane& lambda, const TetraLanes& f, const TetraLanes& rate) noexcept;

}  // namespace palpate
