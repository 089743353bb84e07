// Bases for the scheme `balanced`: computed off-line at the body's rest state, once for each place of contact, and used in every
// frame with the current tangents.
//
// A patch is a second-order model, so positions are balanced: the controllability Gramian P of the linearised body at its port
// (linear/low_rank_gramian.hpp) has the position block P_q, the observability Gramian the velocity block Q_v. M, D and K are
// symmetric and the port is collocated, so Q = S P S makes Q_v = P_q, and position-velocity balancing (Meyer and Srinivasan, IEEE
// TAC 41 (1996); Reis and Stykel, MCMDS 14 (2008)) is the orthogonal projection onto the leading eigenvectors of P_q, orthonormal
// in M: it keeps K and D symmetric and positive semi-definite, and the patch passive. The columns are in the order of their
// eigenvalues, so the best r of them are the first r.
//
// The input is the rate of the tool's action, its velocity u = d' (grasp) or the rate of its force (touch): a hand's motion lacks
// the power at high frequencies that white displacement would have. With q_s = K^-1 B_k the static response and q = q_s d + y
//     M y'' + D y' + K y = (B_d - D q_s) u - M q_s u',
// a system of the same form. q_s is first in the basis, so statics at rest are exact; the leading eigenvectors of y's P_q follow.
// (Balanced for the displacement itself, a dozen states lose 8 dB; docs/decisions/0008-balanced.md.)
//
// Touch: every vertex of the surface gets q_s and its factor Z when it is first touched, all with the same ADI shifts, so that
// those of a point inside a triangle are the weighted means of its corners' and the basis moves smoothly with the contact.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "bench/paper/low_rank_gramian.hpp"
#include "server/body/skin.hpp"

namespace palpate {

class BalancedBases {
 public:
  /// Number of columns of the bases: the most that a patch carries.
  static constexpr int kColumns = kMaxModes;

  /// All three must outlive the bases; nothing is computed before it is requested. `rest`: the state of the linearisation.
  BalancedBases(const Dynamics& dynamics, const Skin& skin, const BodyState& rest)
      : dynamics_(&dynamics), skin_(&skin), rest_(&rest) {}

  /// Returns 3 N x kColumns (fewer for a tiny body), M-orthonormal. A body that is not stable at rest (not fixed anywhere) is
  /// balanced for responses that decay at 5/s.
  const Matrix& grasped(std::uint32_t node);
  Matrix touched(const SurfacePoint& point);

 private:
  /// Responses times M^1/2.
  struct Response {
    Matrix statics, factor;  ///< q_s, 3 N x 3; displacement part of Z, 3 N x columns
  };
  /// Factorisations that are reused for the next vertex.
  struct CachedPatch {
    std::optional<DynamicStiffness::At> still;
    ShiftMemory shifts;
  };

  Response respond(SecondOrderSystem system, double residual, CachedPatch& kept) const;
  const Response& vertex_response(std::uint32_t vertex);
  Matrix basis(const Response& response) const;

  const Dynamics* dynamics_;
  const Skin* skin_;
  const BodyState* rest_;
  std::map<std::uint32_t, Matrix> grasped_;
  std::map<std::uint32_t, Response> vertices_;
  CachedPatch kept_;
  bool discounted_ = false;  ///< for touch: the body is not stable at rest
};

/// Returns the first `columns` of a basis without the held nodes, made orthonormal in the masses again.
Matrix restricted_basis(const Matrix& basis, Eigen::Index columns, const Vector& masses, const std::vector<std::uint8_t>& held);

}  // namespace palpate
