// The kernel of a hexahedron of eight nodes with one mean gradient and a physical hourglass stiffness: its energy, nodal forces
// and tangents. The laws of the solid are those of tetra_kernel.hpp.
//
// Nodes x_0..x_7, node i at the corner xi_i of the cube [-1, 1]^3, where the bits of i select the coordinates that are +1; rest
// positions X_i, V their volume, N_i the trilinear shape functions, J the columns dX/dxi at the centre (half-edges). h_1 = xi_2
// xi_3, h_2 = xi_3 xi_1, h_3 = xi_1 xi_2, h_4 = xi_1 xi_2 xi_3 are the hourglass modes. With
//
//     b_i = 1/V int grad N_i dV,     gamma_ai = (h_a(xi_i) - sum_k h_a(xi_k) X_k . b_i) / 8,
//     g_i = (b_i, gamma_i), 7 numbers
//
// the generalised gradient is a 3 x 7 matrix
//
//     sum x_i g_i^T = (F, q_1, .., q_4)     F mean deformation gradient, q_a [m] amplitude of mode a
//
// exact for affine motions, for which q = 0. The energy is
//
//     E = V Psi(F) + 1/2 sum_a k_a |q_a|^2
//
// It is objective, as q_a rotates with the element, and quadratic in the modes: their stiffness is independent of the deformation
// of the element, so that a patch has all of it in its linear part. k_a is chosen such that a bar of such elements bends as beam
// theory predicts: mode xi_k xi_b along J_b is bending over k of fibres along b, and with Young's modulus E
//
//     k_a = V/3 E m(1 / |J_b|^2, 1 / |J_k|^2),  {a, b, k} = {1, 2, 3},      k_4 = V/9 E / 3 sum_k 1 / |J_k|^2
//
// with m the harmonic mean: either direction may be the one that bends, and flat elements should not be too stiff. Exact for bars
// of cubes. A plate, which bends in both directions, is too soft by nu^2 within one element; that error falls with the square of
// the element size. Pressure is constant in an element: it does not lock as nu -> 1/2.
//
// Viscous stress: on F as in tetra_kernel.hpp; on the modes t k_a times the rate of F^T q_a, so that rotations are not resisted.
//
// Source: Flanagan and Belytschko, IJNME 17 (1981), for gamma; Belytschko and Bindeman, Assumed strain stabilization of the eight
// node hexahedral element, CMAME 105 (1993), for a stiffness of the modes derived from bending.
#pragma once

#include "server/body/tetra_kernel.hpp"

namespace palpate {

inline constexpr int kModesOfHexa = 4;  ///< hourglass modes
using Mat38 = Eigen::Matrix<double, 3, 8>;
/// (F, q_1, .., q_4), and a stress or rate of the same shape.
using Mat37 = Eigen::Matrix<double, 3, 7>;
using Mat78 = Eigen::Matrix<double, 7, 8>;

/// Constants of an element.
struct HexaRest {
  /// The nodes' rest positions as columns; they must span a positive volume.
  explicit HexaRest(const Mat38& rest);
  Mat78 g;            ///< columns g_i [1/m, and 1]
  double volume_m3;   ///< V
  Mat3 half_edges_m;  ///< J
};

/// Stiffness and damping of the hourglass modes of one element.
struct Hourglass {
  Hourglass(const SolidMaterial& material, const HexaRest& rest);
  Eigen::Vector4d k;  ///< k_a [N/m]
  double damping_s;   ///< t [s]
};

/// Returns E [J].
double elastic_energy(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient);
/// Returns dE / d(F, q) [J and N]; the force on node i is minus its product with g_i.
Mat37 elastic_stress(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient);
/// Returns the viscous stress, at a rate of (F, q).
Mat37 viscous_stress(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                     const Mat37& rate);

/// The derivatives of elastic_stress and viscous_stress at one (F, q). `clamp`: no eigenvalue of the elastic one is negative.
class HexaTangent {
 public:
  HexaTangent(const TetraMaterial& material, const Mat37& gradient, bool clamp);
  /// Returns c_k times the block of K plus c_d times that of D, for nodes i and j.
  Mat3 block(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, int i, int j, double c_d,
             double c_k) const;

  const TetraTangent& of_law() const { return of_law_; }
  Mat3 f() const { return gradient_.leftCols<3>(); }
  Mat34 q() const { return gradient_.rightCols<4>(); }

 private:
  Mat37 gradient_;
  TetraTangent of_law_;
};

}  // namespace palpate
