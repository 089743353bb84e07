// Runs a scenario in the simulated world under all checks.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/world/check.hpp"
#include "bench/world/frame_log.hpp"
#include "bench/world/scenario.hpp"

namespace palpate {

/// One row of felt forces, for files and plots.
struct FeltRow {
  Micros now{};
  std::size_t station = 0;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();
  Micros patch_age{};  ///< -1: no patch
  bool contact = false;
};

struct WorldReport {
  std::uint64_t hash = 0;             ///< hash of every felt force and every sent datagram, with their times
  std::vector<std::uint64_t> trail;   ///< hash after every tick
  std::vector<Violation> violations;  ///< the first of each check, ordered by time
  std::uint64_t ticks = 0, datagrams = 0, frames = 0, frames_failed = 0, patches_used = 0, joins = 0;
  Micros oldest_calm{};        ///< largest age of a patch in use at a calm station in reach of the body
  double energy_lowest_j = 0;  ///< PassivityCheck
  double apart_worst_n = 0;    ///< RecoveryCheck: largest difference of felt and true force at rest
  std::vector<std::pair<std::string, std::uint64_t>> judged;  ///< number of judgements of each check
  std::vector<FeltRow> rows;                                  ///< if requested
};

struct RunOptions {
  bool keep_rows = false;
  std::optional<WorldKeys> keys = {};
  bool once = false;  ///< see WorldOptions
  bool check = true;  ///< false: nothing is judged; only hash, trail and counts
  FrameRunner run_frame = [](Room& room, const FrameJob& job) { return room.run(job); };
  /// Called when the world is ready to run; tests of the checks break something here.
  std::function<void(World&)> prepare;
};

WorldReport run_scenario(const Scenario& scenario, const RunOptions& options = {});

/// Runs the scenario twice: the second run has to give the same bits, otherwise there is a violation named `repeat` at the first
/// tick that differs.
WorldReport run_twice(const Scenario& scenario, const RunOptions& options = {});

/// Bounds on each station in this scenario.
std::vector<StationBounds> bounds_of(const Scenario& scenario);

}  // namespace palpate
