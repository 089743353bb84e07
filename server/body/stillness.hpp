// Test whether an untouched body would stay where it is, so that it need not be stepped.
//
// Near an equilibrium x_e a body is linear, M q'' + D q' + K q = 0 with q = x - x_e, and its energy never grows:
//     |q(t)|_M <= sqrt(|q'|_M^2 + q^T K q) / w <= sqrt(|v|_M^2 + |M^-1 F|_M^2 / w^2) / w = d,      |y|_M^2 = y^T M y
// with w^2 the lowest eigenvalue of K y = mu M y and F = F(x, 0) the residual force. So a node of mass m is from now on always
// within d / sqrt(m) of x_e, and within twice that of its present position. w is that of the body at rest; a compressed body is
// softer, hence kSofter.
//
// Implicit steps end with residual forces in stiff directions, which this bound overestimates by far. A body that is back at
// rest, within kBackM of x_r, has q^T K q = -F^T (x - x_r), which is used instead if it is smaller.
//
// If stress relaxes (relaxation.hpp), w is that of the fully relaxed body, and the residual force after full relaxation counts as
// well.
//
// A body that is not fixed anywhere (w = 0) never counts as still.
#pragma once

#include "server/body/dynamics.hpp"

namespace palpate {

class Stillness {
 public:
  /// Largest distance that a node may still move [m]: a tenth of the accuracy of drawn shapes (shape_stream.hpp), a seventh of
  /// the resolution of a Phantom's encoders, and 4 mN on tissue of 1,000 N/m.
  static constexpr double kMovesM = 4e-6;
  static constexpr double kSofter = 0.5;  ///< ratio of the present w^2 to that at rest

  static constexpr double kBackM = 1e-6;

  /// `dynamics` must outlive it. `softest_1_s2`: w^2 at rest, 0 for a body that is not fixed. `rest`: x_r, an
  /// equilibrium; empty: none is known.
  Stillness(const Dynamics& dynamics, double softest_1_s2, Vector rest);

  /// Returns true if the body is still. Requires that no tool touches it and that no node but the fixed ones is held.
  bool holds(const BodyState& state);

 private:
  double unbalanced(const BodyState& state);
  double unbalanced_by(const Vector& x);

  const Dynamics* dynamics_;
  Vector rest_;
  double w2_, most_kg_m2_ = 0;  // largest d^2 that counts as still
  Vector f_;
};

}  // namespace palpate
