// Bases for the scheme `balanced`: computed off-line at the body's rest state, once for each place of contact, and used for every
// frame with the tangents of the moment.
//
// A patch is a second-order model, so what is balanced is positions: the controllability Gramian P of the linearised body at its
// port (linear/low_rank_gramian.hpp) has the position block P_q, the observability Gramian the velocity block Q_v. M, D and K are
// symmetric and the port is collocated, so Q = S P S makes Q_v = P_q, and position-velocity balancing (Meyer and Srinivasan, IEEE
// TAC 41 (1996); Reis and Stykel, MCMDS 14 (2008)) is the orthogonal projection onto the leading eigenvectors of P_q, orthonormal
// in M: it keeps K and D symmetric and positive semi-definite, and the patch passive. The columns come in the order of their
// eigenvalues, so the best r of them are the first r.
//
// Grasp: the input is the displacement of the held node. Touch: the input is a force at the contact point; every vertex of the
// surface gets its factor Z when it is first touched, all with the same ADI shifts, so that the factor of a point inside a
// triangle is the weighted mean of its corners' and the basis moves smoothly with the contact.
#pragma once

#include <map>
#include <vector>

#include "server/body/skin.hpp"
#include "server/linear/low_rank_gramian.hpp"

namespace palpate {

class BalancedBases {
 public:
  /// Columns of the bases: the most that a patch carries.
  static constexpr int kColumns = kMaxModes;

  /// All three must outlive the bases; nothing is computed before it is asked for. `rest`: where the body is linearised.
  BalancedBases(const Dynamics& dynamics, const Skin& skin, const BodyState& rest)
      : dynamics_(&dynamics), skin_(&skin), rest_(&rest) {}

  /// 3 N x kColumns (fewer on a tiny body). A body that is not stable at rest (fixed nowhere) is balanced for responses that fade
  /// at kDiscount.
  const Matrix& grasped(std::uint32_t node);
  Matrix touched(const SurfacePoint& point);

 private:
  const Matrix& vertex_factor(std::uint32_t vertex);
  Matrix displacement_factor(SecondOrderSystem system, ShiftMemory* memory);

  const Dynamics* dynamics_;
  const Skin* skin_;
  const BodyState* rest_;
  std::map<std::uint32_t, Matrix> grasped_, factors_;  // factors: displacement part of Z, 3 N x columns, times M^1/2
  ShiftMemory shifts_;
};

/// The first `columns` of a basis without the held nodes, orthonormal in the masses again.
Matrix restricted_basis(const Matrix& basis, Eigen::Index columns, const Vector& masses, const std::vector<std::uint8_t>& held);

}  // namespace palpate
