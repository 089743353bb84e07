// Damper that keeps several hands on one body calm: each feels the others through the body, but late.
//
// Where hand a displaces the body, hand b feels it after T_ab, moves, and a feels that after T_ba. With K_ab the stiffness
// between the two tools and a damper b_a at each, the energy that both displays absorb is, by |x(t) - x(t - T)| <= int |v| and
// Cauchy and Schwarz,
//
//     W >= b_a |v_a|^2 + b_b |v_b|^2 - K_ab (T_ab + T_ba) |v_a| |v_b|        (norms over time)
//
// so two tools with b = K_ab (T_ab + T_ba) / 2 are passive for any delays up to these (Nuno, Ortega, Barabanov and Basanez, IEEE
// Trans. Robotics 24, 2008). What a patch predicts of the other hand is not late: the damper is needed for the share 1 - s of the
// motion alone that prediction misses (predictability.hpp), and hardly felt by a hand that moves smoothly:
//
//     F = -b v,    b = min(0.7 (1 - s) T sum_b K_ab, kMostNSM)    (kMostGuidedNSM while the tool guides or is guided)
//
// T is the age that patches reach. K_ab = c_ab / (c_aa c_bb - c_ab^2) is that of the patch at rest, along the normals n:
// c_xy = n_x^T R_x K^-1 R_y^T n_y, to which c_xx adds n^T c_static n and 1 / k_c [m/N]. v is low-passed by kFilterS against the
// encoder's steps, and b follows its value within kFollowS. A display without other tools has no damper.
#pragma once

#include "common/base/types.hpp"
#include "common/patch/patch.hpp"
#include "common/player/predictability.hpp"

namespace palpate {

/// Returns sum_b K_ab of a patch [N/m]; 0 without other tools.
double stiffness_between_tools(const Patch& patch) noexcept;

class HandsDamper {
 public:
  /// More: the filter's lag at the pace of b / m, and the encoder's steps, keep a light hand moving, which has 0.2 kg with its
  /// device (docs/decisions/0072-several-hands-stay-calm.md).
  static constexpr double kMostNSM = 20;
  static constexpr double kMostGuidedNSM = 30;  ///< while the tool guides or is guided
  static constexpr double kFilterS = 0.005, kFollowS = 0.05;

  /// Sets the patch in use.
  void play(const Patch& patch) noexcept { stiffness_n_m_ = stiffness_between_tools(patch); }
  /// Advances by a tick of `dt_s` and returns the force on the tool [N], zero where it does not touch. `age_s`: T.
  Vec3 tick(const Vec3& position, bool touches, double age_s, double dt_s, bool guided = false) noexcept;
  /// Forgets the hand's past.
  void restart() noexcept { *this = {}; }

 private:
  double stiffness_n_m_ = 0, damping_n_s_m_ = 0, since_s_ = 0;
  Vec3 before_ = Vec3::Zero(), velocity_ = Vec3::Zero();
  bool moves_ = false;
  Predictability past_;
};

}  // namespace palpate
