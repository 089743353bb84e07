// How the stress of a solid fades: quasi-linear viscoelasticity, as states of the body.
//
// With S_e the second Piola-Kirchhoff stress of the law (tetra_kernel.hpp) and a Prony series of shares g_k and times tau_k,
//
//     S(t) = int G(t - s) dS_e(s),     G(t) = 1 - sum_k g_k (1 - exp(-t / tau_k)),     sum_k g_k < 1
//
// every branch is one relaxed stress Z_k, which the elements remember:
//
//     S = S_e - sum_k g_k Z_k,     Z_k' = (S_e - Z_k) / tau_k     (Z_k = 0: just bent; Z_k = S_e: bent for ever)
//
// LumpedBody::materials are those of fast motions, G(0) = 1; of slow ones they are 1 - sum g_k times that. A step of length h
// goes half of it in Z with x, then in x with Z, then the other half: of second order (Strang), and nothing of Newton's method
// changes, as with F = sum x_j b_j^T the force of Z on the nodes of an element of volume V is linear in x,
//
//     V F Z b_i = sum_j (V b_i . Z b_j) x_j,   so   f_i += sum_j q_ij (x_j - x_i),   q_ij = sum_e V b_i . sum_k g_k Z_k b_j [N/m]
//
// force densities, a number for each pair of nodes that share an element, which act on x, y and z alike; K has their Laplacian.
// Of a hexahedron (F, q) and its stress (P, p) are taken back together, P = F S + q s^T, p_a = F s_a, and
// q_ij = g_i . [[V Z, z], [z^T, 0]] g_j (hexa_kernel.hpp).
//
// F^-1 P has no bound where an element is flat: J = det F counts as kLeastVolume where it is less.
//
// Source: Fung, Biomechanics: Mechanical Properties of Living Tissues (1993), 7.6; Simo, CMAME 60 (1987), for the update; Schek,
// The force density method, CMAME 3 (1974); Strang, SIAM J. Numer. Anal. 5 (1968).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/body/hexahedra.hpp"
#include "server/body/tetrahedra.hpp"

namespace palpate {

/// What the elements of a body remember, the same for all copies of a state.
struct StressHistory {
  Vector at;                    ///< where the body was last
  Matrix elastic;               ///< S_e there, an element a column [J]
  std::vector<Matrix> relaxed;  ///< Z_k [J]
  Vector densities;             ///< q of every pair [N/m]
};

/// Its relaxed stresses, branch after branch.
Eigen::MatrixXf side_by_side(const StressHistory& history);

class Relaxation {
 public:
  static constexpr double kLeastVolume = 0.2;

  /// `body` and its elements must outlive it; `pattern` of edges_of(body).
  Relaxation(const LumpedBody& body, const Tetrahedra& tetrahedra, const Hexahedra& hexahedra, const BlockPattern& pattern);

  bool empty() const { return branches().empty(); }
  std::span<const PronyBranch> branches() const { return body_->relaxation; }
  /// What of the stress is left in the end, 1 - sum g_k.
  double left() const;
  /// Z_k after `h_s` more where the body is.
  void relax(double h_s, BodyState& state) const;
  /// It has been there for ever: Z_k = S_e.
  void relax_fully(BodyState& state) const;
  /// What side_by_side() gave; false where it is of another body.
  bool take_up(const Eigen::MatrixXf& relaxed, BodyState& state) const;
  /// f += forces of the relaxed stress.
  void add_forces(const BodyState& state, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// sum_j q_ij (x_j - x_i) with q of S_e - Z_k: what a branch's force on the nodes tends to, tau_k times as fast.
  std::vector<Vector> pulls(const BodyState& state) const;
  /// A += c_k times what K has of it, but for rows and columns of held nodes; `clamp`: densities that soften are left out.
  void add_tangents(const BodyState& state, double c_k, const std::vector<std::uint8_t>& held, bool clamp, BlockMatrix& a) const;
  /// c_k K Y is added for the columns of Y.
  void add_products(const StressHistory* history, const std::vector<NodeLanes>& y, double c_k, std::vector<NodeLanes>& to) const;
  /// The potential of those forces while Z stays [J].
  double energy(const BodyState& state) const;

  /// Z, summed over branches with their shares, of a tetrahedron or hexahedron [Pa].
  Mat3 relaxed_stress(const BodyState& state, std::uint32_t element) const;

 private:
  struct Pair {
    std::uint32_t a, b;          // a < b
    std::uint32_t upper, lower;  // entries of the pattern
  };
  std::uint32_t elements() const;
  int numbers() const;  // of an element's stress
  Matrix elastic(const Vector& x) const;
  /// q of one stress of all elements.
  void add_densities(const Matrix& stress, double share, Vector& q) const;
  Vector densities(const std::vector<Matrix>& relaxed) const;

  const LumpedBody* body_;
  const Tetrahedra* tetrahedra_;
  const Hexahedra* hexahedra_;
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> pair_of_;           // of each element's pairs of nodes i < j, row by row
  std::vector<std::uint32_t> first_, incident_;  // pairs of each node
};

}  // namespace palpate
