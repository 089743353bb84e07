// Any motion through any scheme over any link, in virtual time, by the real cores (world.hpp), beside the reference.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "bench/measure/metrics.hpp"
#include "bench/world/world.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

struct ReplayOptions {
  Scheme scheme = Scheme::port;
  int order = 0;  ///< states, 0 = the scheme's default
  double rate_hz = 20;
  LinkSpec link;  ///< one way
  std::uint64_t seed = 1;
  Micros compute{};
  bool simulated_device = false;  ///< a Phantom in a hand that follows the motion, instead of the motion itself
};

struct ReplayTick {
  Vec3 position = Vec3::Zero(), felt = Vec3::Zero(), reference = Vec3::Zero();
  Micros patch_age{};
  bool contact = false;
};

struct ReplayResult {
  std::vector<ReplayTick> ticks;  ///< 0, 1, 2, ... ms into the motion
  Fidelity fidelity;
  std::uint64_t patches_used = 0;
  double patch_bytes_mean = 0;
  int patch_states = 0;
  double hand_over_step_max_n = 0;
  // wall clock of this machine
  double tick_ns_p50 = 0, tick_ns_p99 = 0, patch_build_ms_mean = 0, frame_ms_mean = 0;
};

/// Nanoseconds of some steady clock; handed in, because measuring is not the experiment's business.
using Stopwatch = std::function<std::int64_t()>;

inline constexpr std::size_t kSkipTicks = 250;  ///< fidelity is measured from 0.25 s on

/// Throws InputError when the station cannot join, std::runtime_error when the model fails.
ReplayResult replay(const Scene& scene, const Motion& motion, const ReplayOptions& options, const Stopwatch& stopwatch);
/// Several stations on one body, a motion each, all starting at the same moment; the shortest motion ends the run. Links draw
/// from seeds of their own. `patch_build_ms_mean` is that of all patches of a frame.
std::vector<ReplayResult> replay_together(const Scene& scene, std::span<const Motion> motions, const ReplayOptions& options,
                                          const Stopwatch& stopwatch);

}  // namespace palpate
