// Any motion through any scheme over any link, in virtual time, by the real cores (world.hpp), beside the reference.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bench/fidelity/metrics.hpp"
#include "bench/fidelity/reference.hpp"
#include "bench/world/world.hpp"
#include "common/motion/motion.hpp"
#include "common/wire/scheme_in_use.hpp"
#include "server/body/stepper.hpp"

namespace palpate {

/// A frame in which a patch was built.
struct LocalStart {
  Micros stamp{};  ///< into the motion
  BodyState body;  ///< there
  ToolPort port;   ///< there
  Matrix modes;    ///< V, 3 N x r, orthonormal in M
};

struct ReplayOptions {
  SchemeAsked scheme = Scheme::port;  ///< none: the server chooses, as one does that takes no time over patches
  int order = 0;                      ///< states, 0 = the scheme's default
  double rate_hz = 20;
  LinkSpec link;                     ///< one way
  std::vector<LinkSpec> links = {};  ///< of several stations, one each; none: `link` for all
  std::uint64_t seed = 1;
  Micros compute{};
  /// Instead of `compute`, when there are any: of the frames that step the body, one after the other, and again from the first.
  std::vector<Micros> frame_times = {};
  bool simulated_device = false;              ///< a Phantom in a hand that follows the motion, instead of the motion itself
  const ReferenceForce* reference = nullptr;  ///< of the same path, when known: without a simulated device runs share it
  PassivityMode passivity = PassivityMode::off;
  double deadband = 0;              ///< of ServerOptions
  std::vector<Micros> resets = {};  ///< of the body, into the motions, ascending
  bool keep_starts = false;         ///< ReplayResult::starts
  /// By tick of the first station: 0 where nothing is scored, as no hand was there. Empty: all is.
  std::vector<std::uint8_t> scored = {};
  /// Hears what is being done, and which share of that is done, every tick.
  std::function<void(const char* what, double share)> progress = {};
};

struct ReplayTick {
  Vec3 position = Vec3::Zero(), felt = Vec3::Zero(), reference = Vec3::Zero();
  Micros patch_age{};
  bool contact = false, true_contact = false;
};

/// What the full model said at the server, frame by frame: the force of the low-rate model.
struct ReplayFrame {
  Micros t{};                 ///< into the motion, when the frame was ready there
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
};

/// A new patch took over.
struct ReplaySwap {
  std::size_t tick = 0;  ///< in which it did
  HandOver between;      ///< the patches
};

struct ReplayResult {
  std::vector<ReplayTick> ticks;  ///< 0, 1, 2, ... ms into the motion
  std::vector<ReplaySwap> swaps;
  std::vector<ReplayFrame> frames;
  Fidelity fidelity;
  OnsetErrors onset;
  HandOverSteps hand_over;  ///< between the patches: what the cross-fade takes over
  HandOverSteps felt_step;  ///< what a swap adds to the force's change from one tick to the next, beyond the reference's own
  Micros age_p95{};         ///< of the patches in use
  double late_share = 0;    ///< of the samples, those that came when the body had gone past them
  std::uint64_t faded_ticks = 0;
  GuardCounts guard;
  std::uint64_t patches_used = 0;
  double patch_bytes_mean = 0;  ///< sent for a patch, with its copies and terms
  int patch_states = 0;
  Patch last_patch;
  std::vector<LocalStart> starts;  ///< of the first station's patches, when asked for
  double uplink_bytes_s = 0, downlink_bytes_s = 0;
  // wall clock of this machine
  double tick_ns_p50 = 0, tick_ns_p99 = 0, patch_build_ms_mean = 0, frame_ms_mean = 0;
};

/// relative_errors() of what was felt (metrics.hpp).
std::vector<double> relative_errors(const ReplayResult& result);

/// Nanoseconds of some steady clock; handed in, because measuring is not the experiment's business.
using Stopwatch = std::function<std::int64_t()>;

inline constexpr std::size_t kSkipTicks = 250;  ///< fidelity is measured from 0.25 s on

/// The reference for a motion that is used as given: the same for every scheme and link.
ReferenceForce reference_of(const Scene& scene, const Motion& motion);

/// Throws InputError when the station cannot join, std::runtime_error when the model fails.
ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch);
/// Several stations on one body, a motion each, all starting at the same moment; the shortest motion ends the run. Links draw
/// from seeds of their own. `patch_build_ms_mean` is that of all patches of a frame. `options.links`, where given, has as many
/// entries as there are motions.
std::vector<ReplayResult> replay_together(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                                          const Stopwatch& stopwatch);

}  // namespace palpate
