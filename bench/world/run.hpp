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

/// One row of what was felt, for files and plots.
struct FeltRow {
  Micros now{};
  std::size_t station = 0;
  Vec3 position = Vec3::Zero(), force = Vec3::Zero();
  Micros patch_age{};  ///< -1: no patch
  bool contact = false;
};

struct WorldReport {
  std::uint64_t hash = 0;             ///< of every force felt and every datagram sent, with their moments
  std::vector<std::uint64_t> trail;   ///< the hash after every tick
  std::vector<Violation> violations;  ///< the first of each check, in the order of time
  std::uint64_t ticks = 0, datagrams = 0, frames = 0, frames_failed = 0, patches_used = 0, joins = 0;
  Micros oldest_calm{};                                       ///< patch in use at a calm station in reach of the body
  double energy_lowest_j = 0;                                 ///< PassivityCheck
  double apart_worst_n = 0;                                   ///< RecoveryCheck: felt and true force at rest
  std::vector<std::pair<std::string, std::uint64_t>> judged;  ///< how often each check had something to judge
  std::vector<FeltRow> rows;                                  ///< when asked for
};

struct RunOptions {
  bool keep_rows = false;
  std::optional<WorldKeys> keys = {};
  bool once = false;  ///< of WorldOptions
  bool check = true;  ///< else nothing is judged: hash, trail and counts alone
  FrameRunner run_frame = [](Room& room, const FrameJob& job) { return room.run(job); };
  /// Something to break, for tests of the checks: called when the world is ready to run.
  std::function<void(World&)> prepare;
};

WorldReport run_scenario(const Scenario& scenario, const RunOptions& options = {});

/// The same twice: the second run has to give the same bits, otherwise there is a violation named `repeat` at the first tick that
/// differs.
WorldReport run_twice(const Scenario& scenario, const RunOptions& options = {});

/// What each station may do in this scenario.
std::vector<StationBounds> bounds_of(const Scenario& scenario);

}  // namespace palpate
