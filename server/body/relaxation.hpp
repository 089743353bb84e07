// Stress relaxation of a solid: quasi-linear viscoelasticity, with internal states of the body.
//
// With S_e the second Piola-Kirchhoff stress of the law (element_material.hpp) and a Prony series of shares g_k and times tau_k,
//
//     S(t) = int G(t - s) dS_e(s),     G(t) = 1 - sum_k g_k (1 - exp(-t / tau_k)),     sum_k g_k < 1
//
// each branch is one relaxed stress Z_k, stored per element:
//
//     S = S_e - sum_k g_k Z_k,     Z_k' = (S_e - Z_k) / tau_k     (Z_k = 0: just deformed; Z_k = S_e: fully relaxed)
//
// LumpedBody::materials are those of fast motions, G(0) = 1; for slow ones the stress is 1 - sum g_k times that. A step of length
// h advances Z by half of it, then x with Z fixed, then Z by the other half (Strang splitting, second order). Newton's method is
// unchanged: with F = sum x_j b_j^T the force of Z on the nodes of an element of volume V is linear in x,
//
//     V F Z b_i = sum_j (V b_i . Z b_j) x_j,   so   f_i += sum_j q_ij (x_j - x_i),   q_ij = sum_e V b_i . sum_k g_k Z_k b_j [N/m]
//
// The q_ij are force densities, one number for each pair of nodes that share an element, equal for x, y and z; K contains their
// Laplacian. For a hexahedron (F, q) and its stress (P, p) are pulled back together, P = F S + q s^T, p_a = F s_a, and
// q_ij = g_i . [[V Z, z], [z^T, 0]] g_j (element_shape.hpp).
//
// F^-1 P is unbounded where an element is flat: J = det F is replaced by kLeastVolume where it is smaller.
//
// Source: Fung, Biomechanics: Mechanical Properties of Living Tissues (1993), 7.6; Simo, CMAME 60 (1987), for the update; Schek,
// The force density method, CMAME 3 (1974); Strang, SIAM J. Numer. Anal. 5 (1968).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/elements/elements.hpp"

namespace palpate {

/// Stress history of the elements of a body, shared by all copies of a state.
struct StressHistory {
  Vector at;                    ///< positions at the last update
  Matrix elastic;               ///< S_e there, one element per column [J]
  std::vector<Matrix> relaxed;  ///< Z_k [J]
  Vector densities;             ///< q of every pair [N/m]
};

/// Returns the relaxed stresses, branch after branch.
Eigen::MatrixXf side_by_side(const StressHistory& history);

class Relaxation {
 public:
  static constexpr double kLeastVolume = 0.2;

  /// `body` and its elements must outlive it; `pattern` is that of edges_of(body).
  Relaxation(const LumpedBody& body, const Tetrahedra& tetrahedra, const Hexahedra& hexahedra, const BlockPattern& pattern);

  bool empty() const { return branches().empty(); }
  std::span<const PronyBranch> branches() const { return body_->relaxation; }
  /// Returns the share of the stress that never relaxes, 1 - sum g_k.
  double left() const;
  /// Advances Z_k by `h_s` [s] at fixed positions.
  void relax(double h_s, BodyState& state) const;
  /// Relaxes the state fully: Z_k = S_e.
  void relax_fully(BodyState& state) const;
  /// Restores the output of side_by_side(); returns false if it is that of another body.
  bool take_up(const Eigen::MatrixXf& relaxed, BodyState& state) const;
  /// Restores the history of a body that was cut: element e has the share share[e] of what was that of before[e].
  void take_up(const StressHistory& was, std::span<const std::uint32_t> before, std::span<const double> share,
               BodyState& state) const;
  /// Adds the forces of the relaxed stress to f.
  void add_forces(const BodyState& state, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  /// Returns sum_j q_ij (x_j - x_i) with q of S_e - Z_k for each branch: tau_k times the rate of its force on the nodes.
  std::vector<Vector> pulls(const BodyState& state) const;
  /// Adds c_k times its part of K to A, except rows and columns of held nodes; `clamp` drops densities that soften.
  void add_tangents(const BodyState& state, double c_k, const std::vector<std::uint8_t>& held, bool clamp, BlockMatrix& a) const;
  /// Adds c_k K Y for the columns of Y.
  void add_products(const StressHistory* history, const std::vector<NodeLanes>& y, double c_k, std::vector<NodeLanes>& to) const;
  /// Returns the potential of those forces at fixed Z [J].
  double energy(const BodyState& state) const;

  /// Returns Z of a tetrahedron or hexahedron, summed over branches with their shares [Pa].
  Mat3 relaxed_stress(const BodyState& state, std::uint32_t element) const;

 private:
  struct Pair {
    std::uint32_t a, b;          // a < b
    std::uint32_t upper, lower;  // entries of the pattern
  };
  std::uint32_t elements() const;
  int numbers() const;  // per element's stress
  Matrix elastic(const Vector& x) const;
  template <class Shape>
  static void find_elastic(const Elements<Shape>& elements, const Vector& x, Matrix& all);
  template <class Shape>
  void add_densities(const Elements<Shape>& elements, const Matrix& stress, double share, Vector& q) const;
  /// Adds q of one stress of all elements, times `share`.
  void add_densities(const Matrix& stress, double share, Vector& q) const;
  Vector densities(const std::vector<Matrix>& relaxed) const;

  const LumpedBody* body_;
  const Tetrahedra* tetrahedra_;
  const Hexahedra* hexahedra_;
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> pair_of_;           // index for each element's pairs of nodes i < j, row by row
  std::vector<std::uint32_t> first_, incident_;  // pairs of each node
};

}  // namespace palpate
