// Replays any motion through any scheme over any link, in virtual time with the real cores (world.hpp), and compares with the
// reference.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/fidelity/metrics.hpp"
#include "bench/fidelity/reference.hpp"
#include "bench/world/world.hpp"
#include "common/motion/motion.hpp"
#include "common/wire/scheme_in_use.hpp"
#include "server/io/frame_cost.hpp"
#include "server/reduction/build_phase.hpp"

namespace palpate {

/// Makes the patch of a station at the end of a frame, from the body and the tool's port (`at`), the patch of scheme `hold` for
/// them, and the age that the patch will reach; empty: no patch.
using PatchMaker = std::function<std::optional<Patch>(const Room::Origin& at, const Patch& held, Micros horizon)>;

/// A rigid 6-DoF proxy of the tool, coupled to the device's pose by a spring: what is sent is the wrench of the coupling and its
/// Jacobian, and while the tool touches, the device renders
///     F(t) = F(t*) - k (h(t) - h(t*)),   T(t) = T(t*) - k rho^2 theta,   theta the rotation vector of R(t) R(t*)^T
/// (OpenSurgSim's virtual tool coupler).
struct StaticJacobian {
  double stiffness_n_m = 0;  ///< k
  double radius_m = 0;       ///< rho
};

struct ReplayOptions {
  SchemeAsked scheme = Scheme::port;  ///< empty: the server chooses, as one that needs no time for patches
  int order = 0;                      ///< states, 0 = the scheme's default
  double rate_hz = 20;
  LinkSpec link;  ///< one way
  std::uint64_t seed = 1;
  Micros compute{};
  /// If given, replaces `compute`: costs of a frame, of which the server knows those of a whole core before the first frame, and
  /// gets `core_share` of one.
  std::optional<FrameCost> cost = {};
  std::vector<std::uint8_t> held = {};  ///< number of each station's tool in the scene (Scene::tool_of()); empty: the first
  bool simulated_device = false;        ///< true: a Phantom in a hand that follows the motion; false: the motion itself
  /// Those of the same paths, one per station, if they are known: runs without a simulated device share them.
  std::span<const ReferenceForce> references = {};
  PassivityMode passivity = PassivityMode::off;
  double deadband = 0;              ///< see ServerOptions
  std::vector<Micros> resets = {};  ///< resets of the body, times into the motions, ascending
  /// By tick of the first station: 0 for ticks without a hand, which are not scored. Empty: all ticks are scored.
  std::vector<std::uint8_t> scored = {};
  PatchMaker make_patch = {};  ///< if not empty, makes the patches instead of the server; `scheme` is then `hold`
  double low_pass_hz = 0;      ///< cut-off of a first-order low-pass of the felt force; 0: none
  /// If given, what each patch holds is completed by this coupling's Jacobian; `scheme` is then `hold`.
  std::optional<StaticJacobian> jacobian = {};
  /// Called every tick with the current activity and the share of it that is done.
  std::function<void(const char* what, double share)> progress = {};
};

struct ReplayTick {
  Vec3 position = Vec3::Zero(), felt = Vec3::Zero(), reference = Vec3::Zero();
  Micros patch_age{};
  bool contact = false, true_contact = false;
  Rotation turn = Rotation::Identity();                              ///< how the tool is held
  Vec3 felt_torque = Vec3::Zero(), reference_torque = Vec3::Zero();  ///< on a tool with a body, about the tool point [N m]
  NeedleTip tip, reference_tip;                                      ///< of a needle
  double opening = 0, felt_grip = 0, reference_grip = 0;             ///< of jaws, and on their opening [N m]
};

/// Force of the full model at the server, frame by frame: the force of the low-rate model.
struct ReplayFrame {
  Micros t{};                 ///< time into the motion at which the frame was ready at the server
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
};

/// A hand-over to a new patch.
struct ReplaySwap {
  std::size_t tick = 0;  ///< tick of the hand-over
  HandOver between;      ///< difference between the patches
};

struct ReplayResult {
  std::vector<ReplayTick> ticks;  ///< 0, 1, 2, ... ms into the motion
  std::vector<ReplaySwap> swaps;
  std::vector<ReplayFrame> frames;
  Fidelity fidelity, torque;  ///< of the force; of the torque on a tool with a body that was touched [N m], else all zero
  Fidelity grip;              ///< on the opening of jaws that were touched [N m], else all zero
  OnsetErrors onset;
  HandOverSteps hand_over;  ///< between the patches, before the cross-fade
  HandOverSteps felt_step;  ///< what a hand-over adds to the change of force from tick to tick, beyond that of the reference
  Micros age_p95{};         ///< 95th percentile of the age of the patches in use
  std::uint64_t faded_ticks = 0;
  GuardCounts guard;
  std::uint64_t patches_used = 0;
  double patch_bytes_mean = 0;  ///< bytes sent per patch, with its copies and terms
  int patch_states = 0;
  Patch last_patch;
  double uplink_bytes_s = 0, downlink_bytes_s = 0;
  // Wall clock of this machine:
  double tick_ns_p50 = 0, tick_ns_p99 = 0, patch_build_ms_mean = 0, frame_ms_mean = 0;
  std::array<double, kPatchParts> phase_ms_mean{};  ///< parts of patch_build_ms_mean, by BuildPhase; for touches alone
};

/// References that a replay computed, for further replays of the same motions.
std::vector<ReferenceForce> references_of(std::span<const ReplayResult> results);

/// relative_errors() of the felt force (metrics.hpp).
std::vector<double> relative_errors(const ReplayResult& result);

/// Nanoseconds of some steady clock; a parameter, as an experiment does not measure time itself.
using Stopwatch = std::function<std::int64_t()>;

inline constexpr std::size_t kSkipTicks = 250;  ///< fidelity is measured from 0.25 s on

/// Reference for a motion that is played as it is: the same for every scheme and link.
ReferenceForce reference_of(const Scene& scene, const Motion& motion);

/// Throws InputError if the station cannot join, std::runtime_error if the model fails.
ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch);
/// Replays several stations on one body, one motion each, all starting at the same moment; the shortest motion ends the run.
/// Links draw from seeds of their own. `patch_build_ms_mean` covers all patches of a frame.
std::vector<ReplayResult> replay_together(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                                          const Stopwatch& stopwatch);

}  // namespace palpate
