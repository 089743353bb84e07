// The release experiment over round trips, frame rates and schemes: shared by its command and the report of the paper.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/measure/release.hpp"

namespace palpate {

struct ReleasePoint {
  Scheme scheme = Scheme::port;
  double rate_hz = 20, rtt_ms = 0;
  StabilityVerdict verdict;
  bool lost = false;
  double display_min_j = 0;

  /// Larger motion of the last two windows [m].
  double last_m() const;
};

/// All available schemes over round trips at one rate, ordered by scheme, then round trip.
using RateSweep = std::vector<ReleasePoint>;

struct ReleaseSweep {
  std::vector<RateSweep> rates;
  /// For each scheme, without delay at the first rate: the least viscous friction of the device, of 0, 0.1, 0.2, 0.5, ... 20 N
  /// s/m, with which it comes to rest; infinity if there is none. Empty in a quick sweep.
  std::vector<double> damping_n_s_m;
};

/// Everything that the grid does not set is as in `base`. Writes sweep_RATEhz.csv, decay_RTTms.csv, damping.csv, summary.json,
/// release_map.svg and release_decay.svg to `out`.
ReleaseSweep sweep_release(const Scene& scene, const ReleaseOptions& base, bool quick, const std::filesystem::path& out);
void print_sweep(const ReleaseSweep& sweep);

/// Writes one run as CSV: t_s from the release on; depth and force along the direction into the body.
void write_release(const std::filesystem::path& file, const Scene& scene, const ReleaseResult& result);

}  // namespace palpate
