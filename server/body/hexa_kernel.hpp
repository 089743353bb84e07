// The kernel of a hexahedron of eight nodes with one mean gradient and a physical hourglass stiffness: its energy, nodal forces
// and tangents. Laws of the solid are those of tetra_kernel.hpp.
//
// Nodes x_0..x_7, node i at the corner xi_i of the cube [-1, 1]^3 whose bits of i say which coordinates are +1; rest positions
// X_i, V their volume, N_i the trilinear shape functions, J the columns dX/dxi in the middle (half-edges). h_1 = xi_2 xi_3, h_2 =
// xi_3 xi_1, h_3 = xi_1 xi_2, h_4 = xi_1 xi_2 xi_3 are the hourglass modes. With
//
//     b_i = 1/V int grad N_i dV,     gamma_ai = (h_a(xi_i) - sum_k h_a(xi_k) X_k . b_i) / 8,     g_i = (b_i, gamma_i) of 7
//     numbers
//
// the generalised gradient is a 3 x 7 matrix
//
//     sum x_i g_i^T = (F, q_1, .., q_4)     F mean deformation gradient, q_a [m] amplitude of mode a
//
// exact for affine motions, for which q = 0. The energy is
//
//     E = V Psi(F) + 1/2 sum_ab (F^T q_a) . C_ab (F^T q_b) + 1/2 k_0 sum_a |q_a|^2
//
// F^T q_a grad h_a is what mode a adds to Green's strain, so E is objective and needs no rotation. C + k_0 1 is the stiffness
// that the modes have in linear elasticity (E, nu, mu of small strains) once nothing holds them but the material: of the part of
// the strain that varies with xi_k, the components in the plane normal to n_k = J^-T e_k, under plane stress,
//
//     V/3 sum_k [ mu |e_k|^2 + mu nu/(1 - nu) (tr e_k)^2 ],   e_k = P_k sym(q_a n_b^T + q_b n_a^T) P_k,   {a, b, k} = {1, 2, 3}
//
// (P_k = 1 - n_k n_k^T / |n_k|^2): exact for bending of a parallelepiped, and bounded for nu -> 1/2; of h_4 the strain along each
// half-edge J_k under uniaxial stress, E V / 18 sum_k (J_k . q_4 / |J_k|^2)^2. k_0, the smallest eigenvalue of it, is what is
// left of it where an element is squashed flat. Pressure is constant in an element: it does not lock as nu -> 1/2.
//
// Viscous: on F as in tetra_kernel.hpp; on the modes t (C + k_0 1) times the rate of F^T q.
//
// Source: Flanagan and Belytschko, IJNME 17 (1981), for gamma; Belytschko and Bindeman, Assumed strain stabilization of the eight
// node hexahedral element, CMAME 105 (1993), and Puso, A highly efficient enhanced assumed strain physically stabilized
// hexahedral element, IJNME 49 (2000), for the stiffness of the modes.
#pragma once

#include "server/body/tetra_kernel.hpp"

namespace palpate {

inline constexpr int kModesOfHexa = 4;  ///< hourglass modes
using Mat38 = Eigen::Matrix<double, 3, 8>;
/// (F, q_1, .., q_4), and a stress that goes with it.
using Mat37 = Eigen::Matrix<double, 3, 7>;
using Mat78 = Eigen::Matrix<double, 7, 8>;
using Mat12 = Eigen::Matrix<double, 12, 12>;

/// What does not change about an element.
struct HexaRest {
  /// The nodes' rest positions as columns; they must span a positive volume.
  explicit HexaRest(const Mat38& rest);
  Mat78 g;            ///< columns g_i [1/m, and 1]
  double volume_m3;   ///< V
  Mat3 half_edges_m;  ///< J
};

/// Energy of the hourglass modes of one element, without V Psi.
struct Hourglass {
  Hourglass(const SolidMaterial& material, const HexaRest& rest);
  Mat12 c;           ///< C, rows 3 a + component [J/m^2]
  double k0;         ///< k_0 [J/m^2]
  double damping_s;  ///< t
};

/// E [J].
double elastic_energy(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient);
/// dE / d(F, q) [J m and J / m]; the force on node i is minus its product with g_i.
Mat37 elastic_stress(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient);
/// The viscous one, at a rate of (F, q).
Mat37 viscous_stress(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                     const Mat37& rate);
/// d^2 of elastic_stress in two directions, as second_order_stress of tetra_kernel.hpp.
Mat37 second_order_stress(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, const Mat37& gradient,
                          const Mat37& change_1, const Mat37& change_2);

/// The derivatives of elastic_stress and viscous_stress at one (F, q). `clamp`: none of the elastic one's eigenvalues is
/// negative.
class HexaTangent {
 public:
  HexaTangent(const TetraMaterial& material, const Hourglass& modes, const Mat37& gradient, bool clamp);
  /// c_k times the block of K and c_d times that of D, for nodes i and j.
  Mat3 block(const TetraMaterial& material, const Hourglass& modes, const HexaRest& rest, int i, int j, double c_d,
             double c_k) const;

  const TetraTangent& of_law() const { return of_law_; }
  Mat3 f() const { return gradient_.leftCols<3>(); }
  Mat34 q() const { return gradient_.rightCols<4>(); }
  /// C F^T q, a column for each mode; zero where the tangent is clamped.
  const Mat34& s() const { return s_; }

 private:
  Mat37 gradient_;
  Mat34 s_;
  TetraTangent of_law_;
};

}  // namespace palpate
