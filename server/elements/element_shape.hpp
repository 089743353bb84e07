// Finite elements at rest: the shapes from which a deformation gradient and the forces of a stress follow.
//
// Nodes x_i, rest positions X_i, V the volume of the element at rest, b_i the gradient of node i's shape function at rest [1/m],
// gamma_i the amplitudes of its hourglass modes (none for a tetrahedron), g_i = (b_i, gamma_i):
//
//     (F, q) = sum x_i g_i^T,   (F', q') = sum v_i g_i^T      F mean deformation gradient, q_a [m] amplitude of mode a
//     E = V Psi(F) + 1/2 sum_a k_a |q_a|^2                    energy [J]
//     f_i = -(V P, k_a q_a) g_i - viscous part                force on node i, P first Piola-Kirchhoff stress [Pa]
//
// sum g_i = 0, and (F, q) is exact for affine motions, for which q = 0.
//
// Tetrahedron: linear shape functions, no modes. A triangle of a membrane is a tetrahedron whose last node is its first: b_3 = 0,
// b_1 and b_2 in its plane at rest, V its area [m^2], moduli multiplied by its thickness [N/m].
//
// Hexahedron: node i at the corner xi_i of the cube [-1, 1]^3, where the bits of i select the coordinates that are +1; N_i the
// trilinear shape functions, J the columns dX/dxi at the centre (half-edges), and the modes h_1 = xi_2 xi_3, h_2 = xi_3 xi_1,
// h_3 = xi_1 xi_2, h_4 = xi_1 xi_2 xi_3:
//
//     b_i = 1/V int grad N_i dV,     gamma_ai = (h_a(xi_i) - sum_k h_a(xi_k) X_k . b_i) / 8
//     k_a = V/3 E m(1 / |J_b|^2, 1 / |J_k|^2),  {a, b, k} = {1, 2, 3},      k_4 = V/9 E / 3 sum_k 1 / |J_k|^2
//
// with Young's modulus E and m the harmonic mean: a bar of such elements bends as beam theory predicts, as mode xi_k xi_b along
// J_b is bending over k of fibres along b, and either direction may be the one that bends; flat elements should not be too stiff.
// Exact for bars of cubes. A plate, which bends in both directions, is too soft by nu^2 within one element; that error falls with
// the square of the element size. Pressure is constant in an element: it does not lock as nu -> 1/2. The energy is objective, as
// q_a rotates with the element, and quadratic in the modes: their stiffness is independent of the deformation of the element, so
// that a patch has all of it in its linear part. Viscous stress of the modes: t k_a times the rate of F^T q_a, t the damping
// time, so that rotations are not resisted.
//
// Truss (a spring, with forces along the line between its nodes only): g_a = -1, g_b = 1, so that its gradient is the vector d =
// x_b
// - x_a [m] between its nodes and its stress the tension along it [N].
//
// Source: Flanagan and Belytschko, IJNME 17 (1981), for gamma; Belytschko and Bindeman, Assumed strain stabilization of the eight
// node hexahedral element, CMAME 105 (1993), for a stiffness of the modes derived from bending.
#pragma once

#include <array>

#include "common/base/types.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

template <int Nodes, int Modes>
struct ElementShape {
  static constexpr int kNodes = Nodes, kModes = Modes, kColumns = 3 + Modes;
  using Positions = Eigen::Matrix<double, 3, Nodes>;    ///< of the nodes, as columns
  using Gradient = Eigen::Matrix<double, 3, kColumns>;  ///< (F, q), or its stress or rate
  using Cell = std::conditional_t<Modes == 0, Tetrahedron, Hexahedron>;

  /// Requires rest positions that span a positive volume, or an area if the last of a tetrahedron's equals the first. V and k_a
  /// are multiplied by `share`, which is that of a cut element's material that is there.
  explicit ElementShape(const Positions& rest, double young_pa = 0, double share = 1);
  Gradient gradient(const Positions& x) const {
    const Positions from_first = x.colwise() - Vec3(x.col(0));
    Gradient sum;
    sum << from_first * b.transpose(), from_first * gamma.transpose();
    return sum;
  }

  Eigen::Matrix<double, 3, Nodes> b;          ///< columns b_i [1/m]
  Eigen::Matrix<double, Modes, Nodes> gamma;  ///< columns gamma_i
  double volume_m3 = 0;                       ///< V
  std::array<double, Modes> k{};              ///< k_a [N/m]
};

struct TrussShape {
  static constexpr int kNodes = 2, kModes = 0, kColumns = 1;
  using Positions = Eigen::Matrix<double, 3, 2>;
  using Gradient = Vec3;

  explicit TrussShape(const Element& of)
      : stiffness_n_m(of.stiffness_n_m), rest_length_m(of.rest_length_m), damping_n_s_m(of.damping_n_s_m) {}
  static Gradient gradient(const Positions& x) { return x.col(1) - x.col(0); }

  double stiffness_n_m, rest_length_m, damping_n_s_m;
};

using TetraShape = ElementShape<4, 0>;
using HexaShape = ElementShape<8, 4>;
inline constexpr int kModesOfHexa = HexaShape::kModes;
using Mat34 = TetraShape::Positions;
using Mat38 = HexaShape::Positions;
using Mat37 = HexaShape::Gradient;

}  // namespace palpate
