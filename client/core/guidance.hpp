// The guided hand: a spring and a damper between this tool and that of a partner on another machine, so that one leads the other
// and both feel it.
//
//     F = g (sat(K (y - x)) - b v),      |sat| <= kForceMostN,      b = K (T_1 + T_2) / 2
//
// x: own tool, v its velocity, low-passed by kVelocityS against the encoder's steps. y: the partner's tool as it was known here,
// low-passed by kTargetS so that its samples make no steps, and never faster than kTargetMostMS. T_1: longest delay of y since
// its samples came, that is the age of the newest one plus kTargetS and a tick; T_2: the same at the partner, which reports it.
// Both ends compute the same
//
//     K = min(kStiffnessMostNM, 2 kDampingMostNSM / (T_1 + T_2))
//
// Stability. sat(K d) is the gradient of a convex potential of the distance d = x_2 - x_1 and has the Lipschitz constant K, so
// the force of each end is that gradient plus an error of at most K |x_j(t) - y_j(t)|, whose norm over time is at most K T_i
// times that of v_j, for any delays that vary up to T_i. By Cauchy and Schwarz the two ends together absorb at least
//
//     b |v_1|^2 + b |v_2|^2 - K (T_1 + T_2) |v_1| |v_2| >= 0
//
// beyond the change of the potential (Nuno, Ortega, Barabanov and Basanez, IEEE Trans. Robotics 24, 2008, with a saturation):
// whatever passive hands, devices and bodies are at the two ends, they come to rest. The errors of both ends' clock offsets
// cancel in T_1 + T_2. The low-passes keep the inequality, as kTargetS^2 >= 2 kVelocityS^2; sampled at 1 kHz, up to 65 Hz. Above,
// K / w + |b| is less than the impedance w m of any device of more than 15 g: the loop's gain is below 1.
// Within a hold T_1 + T_2 only grows, so K only falls, and a falling K takes energy from the spring. The gain g rises once in a
// hold, which gives at most the potential of the distance then: kForceMostN times that distance.
//
// A hold needs fresh samples, a partner that does not object, and its T_2. g rises over kFadeInS and falls over kFadeOutS, when
// samples stop for kSilence, are older than kDelayMost, or the partner leaves, refuses or lets go. A hand that pulls against the
// whole force for kPullS is let go; it is held again after the two tools were within kMeetM for kMeetS. Whatever the samples say,
// the force on a tool at rest changes by less than kStepMostN in a tick. Does not allocate, lock, log or throw.
#pragma once

#include "common/base/sample_history.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// The partner's tool as the server relays it, in the client's clock.
struct PartnerTool {
  Micros stamp{};
  Vec3 position = Vec3::Zero();
  Micros reach{};        ///< T_2, 0 = unknown
  bool willing = false;  ///< true: it is in the room and does not object
};

class GuidanceCoupling {
 public:
  static constexpr double kForceMostN = 3, kStiffnessMostNM = 200, kDampingMostNSM = 10;
  static constexpr double kVelocityS = 0.005, kTargetS = 0.010, kTargetMostMS = 2;
  static constexpr double kFadeInS = 0.3, kFadeOutS = 0.1;
  static constexpr Micros kSilence{150'000}, kDelayMost{600'000};
  static constexpr double kPullS = 1, kMeetM = 0.010, kMeetS = 1;
  static constexpr double kStepMostN = 0.55;

  /// Accepts a newer message of the partner; one that is not finite or outside the world is ignored.
  void hear(const PartnerTool& partner, Micros now) noexcept;
  /// Advances by a tick of `dt_s` > 0 with the own tool at `own` (finite), and returns F [N].
  Vec3 tick(const ToolSample& own, double dt_s) noexcept;
  /// Ends the force at once; the hold begins anew. For gaps in which the device showed nothing.
  void restart() noexcept;

  GuidanceHand hand() const noexcept {
    return released_ ? GuidanceHand::released : gain_ > 0 ? GuidanceHand::holds : GuidanceHand::ready;
  }
  /// Returns true while no partner was heard since the last hold: tick() then returns zero and changes nothing.
  bool idle() const noexcept { return !any_; }
  /// K for a sum of the delays T_1 + T_2 [s].
  static double stiffness_for(double round_s) noexcept {
    return round_s * kStiffnessMostNM > 2 * kDampingMostNSM ? 2 * kDampingMostNSM / round_s : kStiffnessMostNM;
  }
  /// T_1; 0 while unknown.
  double reach_s() const noexcept { return reach_s_; }
  /// g K [N/m] and g b [N s/m].
  double stiffness_n_m() const noexcept { return gain_ * stiffness_for(round_s_); }
  double damping_n_s_m() const noexcept { return stiffness_n_m() * round_s_ / 2; }

 private:
  static constexpr double kTickS = 1e-3;
  static constexpr double kRoundSlope = 3;  ///< fastest growth of T_1 + T_2 in use [s/s]

  bool may_hold(Micros now) const noexcept;
  void follow(const Vec3& own, double dt_s) noexcept;
  void note_delay(Micros now, double dt_s) noexcept;
  void watch_pull(double pull_n, double apart_m, double dt_s) noexcept;

  PartnerTool partner_;
  Micros heard_{};
  bool any_ = false;  ///< true: `partner_` has a position
  Vec3 target_ = Vec3::Zero(), before_ = Vec3::Zero(), velocity_ = Vec3::Zero();
  bool moves_ = false;   ///< true: `before_` is known
  double reach_s_ = 0;   ///< T_1
  double round_s_ = 0;   ///< T_1 + T_2 in use
  double gain_ = 0;      ///< g
  double pulled_s_ = 0;  ///< time for which the hand has pulled against the whole force
  double met_s_ = 0;     ///< time for which the tools have been close, after a release
  bool released_ = false;
};

}  // namespace palpate
