// Whether a body that is let alone would stay where it is, so that nobody needs to step it.
//
// Near an equilibrium x_e a body is linear, M q'' + D q' + K q = 0 with q = x - x_e, and its energy never grows:
//     |q(t)|_M <= sqrt(|q'|_M^2 + q^T K q) / w <= sqrt(|v|_M^2 + |M^-1 F|_M^2 / w^2) / w = d,      |y|_M^2 = y^T M y
// with w^2 the lowest eigenvalue of K y = mu M y and F = F(x, 0) what is out of balance. So a node of mass m is, now and for
// ever, within d / sqrt(m) of x_e, and within twice that of where it is now. w is that of the body at rest; a body that is
// compressed is softer, hence kSofter.
//
// Implicit steps end with forces out of balance in stiff directions, of which w says far too much. A body that is back where it
// rests, within kBackM of x_r, has q^T K q = -F^T (x - x_r), which is what counts there if it is less.
//
// Where stress fades (relaxation.hpp) w is of what is left of it, and what would be out of balance once all had faded counts too.
//
// A body that is not fixed anywhere (w = 0) never counts as still.
#pragma once

#include "server/body/dynamics.hpp"

namespace palpate {

class Stillness {
 public:
  /// That no node would ever move further than [m]: a tenth of what shapes are drawn within (shape_stream.hpp), a seventh of
  /// what a Phantom's encoders resolve, and 4 mN on tissue of 1,000 N/m.
  static constexpr double kMovesM = 4e-6;
  static constexpr double kSofter = 0.5;  ///< w^2 of the body as it is, to that at rest

  static constexpr double kBackM = 1e-6;

  /// `dynamics` must outlive it. `softest_1_s2`: w^2 at rest, 0 for a body that is not fixed. `rest`: x_r.
  Stillness(const Dynamics& dynamics, double softest_1_s2, Vector rest);

  /// No tool touches the body, no node but the fixed ones is held.
  bool holds(const BodyState& state);

 private:
  double unbalanced(const BodyState& state);
  double unbalanced_by(const Vector& x);

  const Dynamics* dynamics_;
  Vector rest_;
  double w2_, most_kg_m2_ = 0;  // d^2 that is still
  Vector f_;
};

}  // namespace palpate
