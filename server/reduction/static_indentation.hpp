// Static indentation of a body by a tool that presses further, with nonlinear forces: snapshots of a touch (snapshot_set.hpp).
//
// The port responses P^-1 B hold for small displacements. Where elements stiffen or rotate, an indentation as deep as they are
// long has another shape, and a basis without it is too stiff. With s the shift of P, w solves the nonlinear equation whose
// linearisation they are,
//
//     s^2 M w - [F(x* + w, s w) - F(x*, 0)] = B f,     f = kappa (a - B^T w)
//
// one step of backward Euler of 1/s from rest; a is the displacement of a hand that yields like a spring kappa,
// kHandStiffnessRatio times as stiff as the body at the stamp. Far from the port the body deforms little: only the
// kSubdomainNodes nodes nearest to it (for a solid kSolidSubdomainNodes), by elements, use nonlinear forces, all others
// follow w = P^-1 B f. The solver is nonlinear conjugate gradients, preconditioned with the blocks of P's diagonal; the ends of
// the nonlinear subdomain are updated with f in kEndRounds rounds, and each displacement starts from the last.
//
// Source: nonlinear elimination of the strongly nonlinear part, Lanzkron, Rose and Wilkes, SIAM J. Sci. Comput. 17 (1996).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/body/skin.hpp"
#include "server/reduction/basis.hpp"

namespace palpate {

struct IndentationRequest {
  NodeWeights port;                   ///< B, over nodes
  std::span<const Vector> responses;  ///< P^-1 B, three, in the coordinates of the linearisation
  std::vector<Vec3> displacements;    ///< a [m], at least one, each larger than the one before
  double shift_1_s = 20;              ///< s
  std::span<const Mat3> diagonal;     ///< diagonal blocks of P, in these coordinates
};

class StaticIndentations {
 public:
  /// Measured: 200 for springs cost the organ 5 dB (docs/notebook.md, 17), for solids 1.7 dB and a third less time (29).
  static constexpr std::size_t kSubdomainNodes = 300, kSolidSubdomainNodes = 200;
  static constexpr int kEndRounds = 3;              ///< measured: two cost the organ 2 dB (docs/notebook.md, 17)
  static constexpr double kHandStiffnessRatio = 2;  ///< indentations are two thirds of the hand's displacement; less: shallower

  /// For springs or finite elements; `body` must outlive it.
  explicit StaticIndentations(const LumpedBody& body);
  ~StaticIndentations();
  /// Returns w, in the same coordinates, one for each displacement; fewer if the solver fails at some displacement, none if the
  /// body is fixed there.
  std::vector<Vector> shapes(const Linearisation& at, const IndentationRequest& request);

 private:
  const LumpedBody* body_;
  std::vector<std::vector<std::uint32_t>> elements_;  // per node
  struct Cut;
  std::unique_ptr<Cut> cut_;  // around the nodes of the last port
};

}  // namespace palpate
