// The patch player: advances one patch by its exact discrete exponential, a tick at a time, and closes the port.
//
// With z = (q, q'), one step of length dt is z+ = Phi z + Psi0 w0 + Psi1 w1 (propagator.hpp). A step is a tick, or where a patch
// has terms beyond the tangent a part of it (NonlinearForce::steps()), because contact law and terms are of second order and only
// the linear part is exact:
//     attach: the tool moves linearly inside the step: w0 = g + B_k d + B_d d', w1 = B_k (d+ - d)
//     touch:  lambda rises from that of the step before and acts with its mean, w0 = g + (1 - s) R^T lambda + s R-^T lambda-
//             with R = sum_i w_i R_i at the contact point; the end-of-step contact law (contact_law.hpp) gives lambda from p_free
//             and C = (1 - s) R Psi0_q R^T + c_static. s = 1/2: lambda is the force at the step's end; with s = 0 it would be
//             the step's mean, half a step old. But lambda has to compensate at the end for what lambda- does in this step, and
//             where the contact (k_c) is stiffer than what a step moves that oscillates from step to step: s = min(1/2,
//             1 / (2 k_c tr R Psi0_q R^T)), which at least halves oscillations; 0 where it is rigid. Any s up to 1/2 is
//             passive: the mean times the tool's path is what the modes receive plus what the contact stores, and no less.
//             Beyond the patch's piece of surface the tool slides along the plane at its border, where body and friction are as
//             at the border.
// Other tools are contacts, too, and so are the other spheres of a tool with a body (other_contacts.hpp); a needle in the body
// has contacts of its own instead (needle_contacts.hpp), from the step after the one in which it punctures, and a hand that holds
// a thread its spans (suture_contact.hpp). A load that changes
// (patch.load_rate) adds psi0 l t + psi1 l dt to the drift, a sum that grows by one part a step. Stress that relaxes
// (patch.fading) is evaluated half a step ahead of the deformation, s(t + dt/2) = e s(t - dt/2) + (1 - e) (pull + H u(t) - f)
// with e = exp(-dt / time), and acts with that value in the step: of second order.
//
// Shapes and units: r modes, z 2 r, Phi 2 r x 2 r, Psi0, Psi1 2 r x r; g, lambda [N, kg^1/2 m/s^2 in modes], d, d+ [m], d' [m/s],
// R, R- 3 x r (at the contact points of this step and of the one before), C 3 x 3 [m/N]; k_c [N/m], l = load_rate. What can go
// wrong: forces that are not finite, and modes too fast for the step, end the terms, and the linear patch continues; missed ticks
// are made up for, some seconds at most; a contact is found a step late.
//
// Contact begins in the step in which the tool passes through the patch's own deformed surface (onset.hpp), and ends in the step
// in which it would pull. The constructor allocates and belongs off the haptic thread; advance() does not allocate, lock or
// throw. Copyable, so that a player that has been advanced to now can be handed over by value.
//
// Source: for the step of terms Gautschi (1961) and Hairer, Lubich and Wanner (2006), see the constructor; propagator.hpp.
#pragma once

#include <array>

#include "common/base/types.hpp"
#include "common/patch/contact_law.hpp"
#include "common/patch/nonlinear_terms.hpp"
#include "common/patch/patch.hpp"
#include "common/player/needle_contacts.hpp"
#include "common/player/other_contacts.hpp"
#include "common/player/propagator.hpp"
#include "common/player/surface_contact.hpp"
#include "common/player/suture_contact.hpp"

namespace palpate {

inline constexpr Micros kTick{1'000'000 / kHapticRateHz};  ///< period of the haptic loop

struct PlayerOutput {
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
  bool contact = false;
  Vec3 torque = Vec3::Zero();  ///< on a tool with a body, about the tool point [N m]
  double grip = 0;             ///< on the opening of its jaws (tool_shape.hpp) [N m]; from the first step on
};

class PatchPlayer {
 public:
  PatchPlayer() = default;
  /// `patch` has passed check(). The player stands at the patch's stamp.
  explicit PatchPlayer(const Patch& patch) : PatchPlayer(patch, NonlinearTerms{}) {}
  /// The same with forces beyond the tangent; `terms` have passed check() for this patch. With f their force on the modes at the
  /// end of a step, elastic or of dampers that have rotated, a step is
  ///     z+ = Phi z + Psi0 (w0 + f) + ...,   then q'+ += H (f+ - f),   H = Psi0_v - Phi_vv Phi_qv^-1 Psi0_q
  /// exact for a constant force, however fast a mode oscillates or is damped; second order; time-reversible without damping,
  /// where H = tan(omega dt / 2) / omega (Gautschi, Numer. Math. 3 (1961); Hairer, Lubich and Wanner, Geometric Numerical
  /// Integration (2006), XIII.1). With a mode whose period is below 2.7 steps (H > dt) only the linear patch is played.
  PatchPlayer(const Patch& patch, const NonlinearTerms& terms);

  /// Advances to `sample.t`, in ticks, with the tool moving linearly from its last pose. No effect when that is less than
  /// half a tick away.
  PlayerOutput advance(const ToolSample& sample) noexcept;

  const Patch& patch() const { return patch_; }
  Micros time() const { return time_; }
  const PlayerOutput& output() const { return output_; }
  /// Position of vertex `i` of the patch's surface at the end of the step [m].
  Vec3 vertex(int i) const;
  /// Place of a needle's tip on its path.
  const NeedleTip& needle_tip() const { return needle_.tip(); }
  /// Material lengths of the thread that the hand holds [m].
  const OfSpans& thread_lengths() const { return suture_.lengths(); }
  /// Energy of the model, (q'^T q' + q^T K q) / 2 [J], for tests of passivity.
  double energy() const;

 private:
  void step(const ToolPose& tool) noexcept;
  void step_attach(const Vec3& tool) noexcept;
  void step_touch(const ToolPose& tool) noexcept;
  void close_others(const ToolPose& tool) noexcept;
  void close_touch(const ToolPose& pose) noexcept;
  void grow_load() noexcept;
  void fade(const Vec3& displacement) noexcept;
  /// Force on (d, q) or q in addition to the linear patch's: of terms, and of relaxed stress.
  NonlinearForce::Variables forces() const noexcept;
  bool has_forces() const { return !nonlinear_.empty() || fading_.size() > 0; }
  void bend(const Vec3& displacement, const Vec3& velocity) noexcept;

  Patch patch_;
  NonlinearForce nonlinear_;
  int steps_ = 1;                                    // steps in a tick
  double dt_ = 0;                                    // length of a step [s]
  static constexpr int kMaxInputs = kMaxStates + 9;  // size of u below: z, d, d+, d'
  using StepVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxInputs, 1>;
  // z+ = drift + transition u with u = z (touch) or (z, d, d+, d') (attach): one product for any order
  StateVector drift_;         // Psi0 w, with the load of other tools at the step
  StateVector ramp_;          // Psi1 l dt, effect of the load's growth inside a step
  StateVector drift_growth_;  // Psi0 l dt, per step; both while load_steps_ remain
  std::int64_t load_steps_ = 0;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxStates, kMaxInputs> transition_;
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxStates> felt_;  // attach: (B_k^T, B_d^T)
  StateInput psi0_;
  ModeMatrix closing_;                           // H
  NonlinearForce::Variables elastic_, viscous_;  // force on (d, q) or q at a step's end: elastic; of dampers that have rotated
  NonlinearForce::Variables fading_;             // the same of relaxing stress, sum share_k s_k; size 0: there is none
  std::array<NonlinearForce::Variables, kMaxPronyBranches> faded_;  // s_k, half a step ahead
  std::array<double, kMaxPronyBranches> stays_{};                   // exp(-dt / time_k)

  StateVector z_;
  PlayedSurface surface_;
  SurfaceContact contact_;
  PortPush push_;  // at the contact, or without modes its lambda and C
  OtherContacts others_;
  NeedleContacts needle_;
  SutureContact suture_;
  Micros time_{};
  ToolPose tool_;
  PlayerOutput output_;
};

}  // namespace palpate
