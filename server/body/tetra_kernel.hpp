// The kernel of a linear tetrahedron of a hyperelastic, viscous solid: its energy, nodal forces and tangents.
//
// Nodes x_0..x_3, rest positions X_i, rest volume V. b_i is the gradient of node i's shape function at rest [1/m], sum b_i = 0:
//     deformation gradient  F = sum x_i b_i^T,   its rate  F' = sum v_i b_i^T,   J = det F,   G = dJ/dF (cofactors)
//     force on node i       f_i = -V P b_i,      P = P_elastic(F) + P_viscous(F, F')    first Piola-Kirchhoff stress [Pa]
//
// Elastic laws, energy density Psi [J/m^3], Lame parameters mu_L, lambda_L of small strains in both:
//   corotational   Psi = mu |F - R|^2 + lambda/2 tr(R^T F - I)^2,  R the rotation of the polar decomposition, det R = 1 always
//                  (mu = mu_L, lambda = lambda_L); linear elasticity in the rotated frame of each element
//   neo_hookean    Psi = mu/2 (I - 3) - mu/2 ln((I + 1) / 4) + lambda/2 ((J - alpha)^2 - (1 - alpha)^2),  I = |F|^2,
//                  mu = 4/3 mu_L, lambda = lambda_L + 5/6 mu_L, alpha = 1 + 3 mu / (4 lambda): smooth for every F, flat and
//                  inverted included, and without stress at rest
//   mooney_rivlin, veronda_westmann
//                  Psi = mu_1/(2 b) E(b I_1) + mu_2/2 I_2 + lambda/2 (J - 1)^2,  E(y) the integral of e from 0 to y,
//                  I_1 = |F|^2 - 3 - 2 (J - 1),  I_2 = |G|^2 - 3 - 4 (J - 1),
//                  e = exp, from y = 4 on its tangent (solid_law.hpp; mu_1/2 I_1 for b = 0),
//                  mu_1 + mu_2 = mu_L, lambda = lambda_L + mu_1:
//                  where J = 1 the invariants of Mooney and Rivlin minus their values at rest. Their gradients vanish at rest,
//                  so that no part of the law has stress there, and all is smooth for every F, flat and inverted included.
//     mooney_rivlin     b = 0, mu_2 = s mu_L:   c_1 (I_1 - 3) + c_2 (I_2 - 3) with c_1 = (1 - s) mu_L / 2, c_2 = s mu_L / 2
//     veronda_westmann  mu_2 = -mu_L, mu_1 = 2 mu_L:   c_1 (exp(b (I_1 - 3)) - 1) - c_1 b/2 (I_2 - 3) with c_1 = mu_L / b
//   ogden          common/port/ogden.hpp; its lambda is lambda_L + mu_s
// Fibres may be added to each of them, k = `share` mu_L (common/port/fibre_lanes.hpp).
//
// A triangle of a membrane is a tetrahedron whose last node is its first: b_3 = 0, b_1 and b_2 in its plane at rest, V its area
// [m^2], moduli multiplied by its thickness [N/m] and for plane stress, lambda_L = E nu / (1 - nu^2). Its law is
// St. Venant-Kirchhoff,
//   membrane       Psi = mu E : E + lambda/2 tr(E)^2,  E = (F^T F - 1)/2 in the plane,  P = (lambda tr E - mu) F + mu F F^T F
// which resists stretch and shear in its plane and no bending.
// Source: Smith, De Goes and Kim, Stable neo-Hookean flesh simulation, ACM Trans. Graph. 37 (2018); for the eigenvectors of the
// tangents also Smith et al., Analytic eigensystems for isotropic distortion energies, ACM Trans. Graph. 38 (2019). Mooney, J.
// Appl. Phys. 11 (1940); Veronda and Westmann, Mechanical characterization of skin, J. Biomech. 3 (1970).
//
// Viscous law (Kelvin-Voigt): P_viscous = F (2 mu_v E' + lambda_v tr(E') I), E' = sym(F^T F') the rate of Green's strain, mu_v =
// t mu_L, lambda_v = t lambda_L, t the damping time [s]. At rest it is t times the elastic tangent (stiffness-proportional
// Rayleigh damping); it never resists a rigid motion and never gives energy: P_viscous : F' >= 0.
//
// Tangents: dP = a dF + dF M + sum_k c_k (Q_k : dF) Q_k + kappa X(F)[dF] + mu_2 (X(G)[dF] + X(F)[X(F)[dF]]), X(A)[B] the change
// of the cofactors of A with B; mu_2 = 0 except for laws of both invariants, M = M^T = 0 except for ogden and fibres. Exact for
// the elastic part; `clamp` drops the negative eigenvalues, of the law and of its fibres, so that the element's stiffness is
// positive semi-definite. The dependence of P_viscous on F at fixed F' is neglected, as for springs (spring_kernel.hpp).
#pragma once

#include <array>

#include "common/base/types.hpp"
#include "common/port/ogden.hpp"
#include "common/mechanics/polar.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

using Mat34 = Eigen::Matrix<double, 3, 4>;

/// A material with the derived parameters of its law.
struct TetraMaterial {
  explicit TetraMaterial(const SolidMaterial& material);
  bool is_viscous() const { return viscous_mu != 0 || viscous_lambda != 0; }
  SolidLaw law;
  double mu, lambda;              ///< of the law [Pa]; mu_1 for laws of both invariants
  double alpha = 1;               ///< of neo_hookean
  double mu_2 = 0, exponent = 0;  ///< for laws of both invariants [Pa, and 1]
  OgdenLaw ogden;                 ///< relative to mu
  Fibres fibres;
  double fibre_k = 0;                 ///< k [Pa]
  double viscous_mu, viscous_lambda;  ///< mu_v, lambda_v [Pa s]
};

/// Constants of an element.
struct TetraRest {
  /// `rest`: the nodes' rest positions as columns; they must span a positive volume, or the last equals the first and they span
  /// an area.
  explicit TetraRest(const Mat34& rest);
  Mat34 b;           ///< columns b_i [1/m]
  double volume_m3;  ///< V; for a triangle its area [m^2]
};

double elastic_energy_density(const TetraMaterial& material, const Mat3& f);
Mat3 elastic_stress(const TetraMaterial& material, const Mat3& f);
Mat3 viscous_stress(const TetraMaterial& material, const Mat3& f, const Mat3& f_rate);
/// Returns d^2 P_elastic / dF^2 [dF_1, dF_2]: P(F + dF) = P + A dF + 1/2 d^2P[dF, dF] + ...; a finite difference of A for ogden,
/// membrane and fibres.
Mat3 second_order_stress(const TetraMaterial& material, const Mat3& f, const Mat3& df_1, const Mat3& df_2);

/// dP_elastic / dF at one F.
class TetraTangent {
 public:
  TetraTangent(const TetraMaterial& material, const Mat3& f, bool clamp);
  /// Returns dP for a change of F.
  Mat3 apply(const Mat3& df) const;
  /// Returns V d(P b_i)/dx_j, the block of K for nodes i and j.
  Mat3 block(const TetraRest& rest, int i, int j) const { return block(rest.volume_m3, rest.b.col(i), rest.b.col(j), i == j); }
  /// Returns the same for any element with one deformation gradient; `same`: b_i is b_j.
  Mat3 block(double volume_m3, const Vec3& bi, const Vec3& bj, bool same) const;

  const Mat3& f() const { return f_; }
  double a() const { return a_; }
  /// Returns true if M is not 0.
  bool has_m() const { return has_m_; }
  const Mat3& m() const { return m_; }
  double kappa() const { return kappa_; }
  /// Returns mu_2, or 0; g() is G if it is not 0.
  double mu_2() const { return mu_2_; }
  const Mat3& g() const { return g_; }
  std::size_t terms() const { return terms_; }
  double c(std::size_t k) const { return c_[k]; }
  const Mat3& q(std::size_t k) const { return q_[k]; }

 private:
  void corotational(const TetraMaterial& material, bool clamp);
  void neo_hookean(const TetraMaterial& material);
  void of_invariants(const TetraMaterial& material);
  void of_ogden(const TetraMaterial& material);
  void of_membrane(const TetraMaterial& material, bool clamp);
  void clamped(const TetraMaterial& material);
  void add_fibres(const TetraMaterial& material, bool clamp);
  void add_m(const Mat3& m) {
    m_ = has_m_ ? Mat3(m_ + m) : m;
    has_m_ = true;
  }
  void add(double c, const Mat3& q) {
    if (c == 0) return;
    c_[terms_] = c;
    q_[terms_++] = q;
  }

  static constexpr std::size_t kMost = 10;  // nine modes, and one of fibres

  Mat3 f_, g_, m_;
  bool has_m_ = false;
  double a_ = 0, kappa_ = 0, mu_2_ = 0;
  std::size_t terms_ = 0;
  std::array<double, kMost> c_{};
  std::array<Mat3, kMost> q_;
};

/// Returns V d(P_viscous b_i)/dv_j, the block of D for nodes i and j.
Mat3 viscous_block(const TetraMaterial& material, double volume_m3, const Vec3& bi, const Vec3& bj, const Mat3& f);
inline Mat3 viscous_block(const TetraMaterial& material, const TetraRest& rest, const Mat3& f, int i, int j) {
  return viscous_block(material, rest.volume_m3, rest.b.col(i), rest.b.col(j), f);
}

}  // namespace palpate
