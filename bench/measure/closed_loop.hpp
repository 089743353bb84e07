// Hands and devices in the loop: simulated Phantoms on the real cores in the simulated world (world.hpp), in virtual time.
//
// A hand presses along a motion (its intention) and may let go of the device at some moment. From then on only the displayed
// force acts on the device's mass, which exposes the effect of the display. Forces are those after the guard, clamped and
// rendered as by the device.
//
// Energies, exact for the rendered forces (constant between ticks), x true tool position, F rendered force:
//     display  E_n = E_0 - sum F_k . (x_k+1 - x_k)   energy put into the display and not returned [J]; negative: it generates
//     kinetic  T_n = m_device |v_n|^2 / 2
// With a wrist (sim_phantom.hpp), phi_k the rotation of the tool in tick k, M rendered torque, w rate of rotation:
//     E_n -= sum M_k . phi_k,   T_n += J_device |w_n|^2 / 2
// A free device keeps T + E constant: after the release, T can only grow by what the display gives.
//
// One call is one run from a fresh world; it shares nothing with other calls, which may run concurrently on other threads.
#pragma once

#include <optional>
#include <vector>

#include "bench/world/world.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

/// One of the hands on the body.
struct LoopHand {
  Motion intention;
  SimPhantomOptions device;                ///< the hand, its release (motion time), quantisation; the seed is that of the tremor
  LinkSpec link;                           ///< one way
  std::optional<std::size_t> guides = {};  ///< hand whose tool it guides
};

struct ClosedLoopOptions {
  Scheme scheme = Scheme::port;
  int order = 0;  ///< states, 0 = the scheme's default
  double rate_hz = 20;
  std::uint64_t seed = 1;
  Micros compute{};
  PassivityMode passivity = PassivityMode::off;
  Micros duration{};  ///< from the beginning of the motions
};

struct LoopTick {
  Vec3 position = Vec3::Zero(), velocity = Vec3::Zero();  ///< tool, without the quantisation of readings [m], [m/s]
  Rotation turn = Rotation::Identity();                   ///< how the tool is held
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();       ///< on the tool, rendered from this tick to the next [N], [N m]
  Micros patch_age{-1};                                   ///< -1: no patch yet
  double hand_over_step_n = 0;                            ///< force step at the hand-over in this tick, before the cross-fade
  double gain = 1;  ///< displayed share of the patch's force; 1 unless patches are missing or late
  double kinetic_j = 0, display_j = 0;
  Vec3 guidance = Vec3::Zero();  ///< part of the force that is the coupling to another hand's tool, before the guard
};

struct ClosedLoopResult {
  std::vector<LoopTick> ticks;  ///< 0, 1, 2, ... ms into the motion; fewer than requested if the tool was lost
  bool lost = false;            ///< true: the tool moved further than kLostM from its start, which ended the run of all hands
  std::uint64_t patches_used = 0;
  GuardCounts guard;
  HapticCounts haptic;
  Micros guidance_reach{};  ///< longest delay of the other hand's tool in a hold, at the end
};

inline constexpr double kLostM = 0.2;

/// Returns one result for each hand. Throws InputError if a station cannot join or an option is out of range, std::runtime_error
/// if nobody answers.
std::vector<ClosedLoopResult> closed_loop(const Scene& scene, std::span<const LoopHand> hands, const ClosedLoopOptions& options);

/// The same hands on the full model itself, stepped and felt at 1 kHz without frames and network (reference.hpp). In the n-th
/// tick the force of hand k is scaled by the gain of the n-th tick of `cuts[k]` (1 beyond their end). Throws what the model
/// throws.
std::vector<ClosedLoopResult> reference_loop(const Scene& scene, std::span<const LoopHand> hands, Micros duration,
                                             std::span<const ClosedLoopResult> cuts = {});

}  // namespace palpate
