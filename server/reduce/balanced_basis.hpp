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
// The input is the rate of what the tool does, its velocity u = d' (grasp) or the rate of its force (touch): a hand's motion has
// no power at high frequencies that white displacement would have. With q_s = K^-1 B_k the static response and q = q_s d + y
//     M y'' + D y' + K y = (B_d - D q_s) u - M q_s u',
// a system of the same form. q_s opens the basis, so statics at rest are exact; the leading eigenvectors of y's P_q follow.
// (Balanced from the displacement itself, a dozen states lose 8 dB; docs/decisions/0008-balanced.md.)
//
// Touch: every vertex of the surface gets q_s and its factor Z when it is first touched, all with the same ADI shifts, so that
// those of a point inside a triangle are the weighted means of its corners' and the basis moves smoothly with the contact.
#pragma once

#include <map>
#include <optional>
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

  /// 3 N x kColumns (fewer on a tiny body), M-orthonormal. A body that is not stable at rest (fixed nowhere) is balanced for
  /// responses that fade 5/s.
  const Matrix& grasped(std::uint32_t node);
  Matrix touched(const SurfacePoint& point);

 private:
  /// Times M^1/2.
  struct Response {
    Matrix statics, factor;  ///< q_s, 3 N x 3; displacement part of Z, 3 N x columns
  };
  /// Factorisations for the next vertex.
  struct Kept {
    std::optional<DynamicStiffness::At> still;
    ShiftMemory shifts;
  };

  Response respond(SecondOrderSystem system, double residual, Kept& kept) const;
  const Response& vertex_response(std::uint32_t vertex);
  Matrix basis(const Response& response) const;

  const Dynamics* dynamics_;
  const Skin* skin_;
  const BodyState* rest_;
  std::map<std::uint32_t, Matrix> grasped_;
  std::map<std::uint32_t, Response> vertices_;
  Kept kept_;
  bool discounted_ = false;  ///< of touch: the body is not stable at rest
};

/// The first `columns` of a basis without the held nodes, orthonormal in the masses again.
Matrix restricted_basis(const Matrix& basis, Eigen::Index columns, const Vector& masses, const std::vector<std::uint8_t>& held);

}  // namespace palpate
