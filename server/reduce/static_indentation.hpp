// How a body yields to a tool that goes on into it, by its own forces: snapshots of a touch (snapshot_set.hpp).
//
// P^-1 B, the port responses, are those of small displacements. Where elements stiffen or turn, an indentation as deep as they
// are long has another shape, and a basis that does not know it is too stiff. With s the shift of P, w solves what those
// linearise,
//
//     s^2 M w - [F(x* + w, s w) - F(x*, 0)] = B f,     f = kappa (a - B^T w)
//
// one step of backward Euler of 1/s from rest; a is the displacement of a hand that yields as a spring kappa does,
// kHandStiffnessRatio times as stiff as the body at the stamp. Far from the port the body bends little: only the kSubdomainNodes
// nodes nearest to it (of a solid kSolidSubdomainNodes), by elements, follow their own forces, all others w = P^-1 B f. Nonlinear
// conjugate gradients with the blocks of P's diagonal, the ends of the nonlinear subdomain moved with f in kEndRounds rounds,
// from each displacement on to the next.
//
// Source: nonlinear elimination of the part that is far from linear, Lanzkron, Rose and Wilkes, SIAM J. Sci. Comput. 17 (1996).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/body/skin.hpp"
#include "server/reduce/basis.hpp"

namespace palpate {

struct IndentationRequest {
  Skin::Weights port;                 ///< B, of nodes
  std::span<const Vector> responses;  ///< P^-1 B, three, in the coordinates of the linearisation
  std::vector<Vec3> displacements;    ///< a [m], at least one, each further than the one before
  double shift_1_s = 20;              ///< s
  std::span<const Mat3> diagonal;     ///< blocks of P's, in these coordinates
};

class StaticIndentations {
 public:
  /// Measured: 200 of springs cost the organ 5 dB (docs/notebook.md, 17), of solids 1.7 dB and a third less time (29).
  static constexpr std::size_t kSubdomainNodes = 300, kSolidSubdomainNodes = 200;
  static constexpr int kEndRounds = 3;              ///< measured: two cost the organ 2 dB (docs/notebook.md, 17)
  static constexpr double kHandStiffnessRatio = 2;  ///< indentations are two thirds as deep as a hand goes; less: shallower

  /// Springs or finite elements; `body` must outlive it.
  explicit StaticIndentations(const LumpedBody& body);
  ~StaticIndentations();
  /// w, in these coordinates too, one for each displacement; fewer where the body cannot be followed so far, none where it is
  /// fixed.
  std::vector<Vector> shapes(const Linearisation& at, const IndentationRequest& request);

 private:
  const LumpedBody* body_;
  std::vector<std::vector<std::uint32_t>> elements_;  // of each node
  struct Cut;
  std::unique_ptr<Cut> cut_;  // around the nodes of the last port
};

}  // namespace palpate
