// The release experiment over round trips, frame rates and schemes.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/measure/release.hpp"

namespace palpate {

struct SweepPoint {
  Scheme scheme = Scheme::port;
  double rate_hz = 20, rtt_ms = 0;
  StabilityVerdict verdict;
  bool lost = false;
  double display_min_j = 0;

  /// The highest of the last two windows [m].
  double last_m() const;
};

struct SweepGrid {
  double rate_hz = 20;
  std::vector<double> rtt_ms;
};

/// All available schemes over a grid; everything else as in `base`. In the order of schemes, then round trips.
std::vector<SweepPoint> sweep_release(const Scene& scene, const ReleaseOptions& base, const SweepGrid& grid);

/// The least viscous friction of the device among 0, 0.1, 0.2, 0.5, ... 20 N s/m with which it comes to rest; infinity for none.
double damping_needed(const Scene& scene, ReleaseOptions options);

/// sweep_RATEhz.csv, and decay_RTTms.csv for each of `decays_ms`, in `out`.
void write_sweep(const std::filesystem::path& out, const std::vector<SweepPoint>& points, const std::vector<double>& decays_ms);
/// A map of what is left of the motion, for each rate; false without gnuplot.
bool plot_sweep(const std::filesystem::path& out, const std::filesystem::path& svg,
                const std::vector<std::vector<SweepPoint>>& sweeps);
bool plot_decays(const std::filesystem::path& out, const std::filesystem::path& svg, const std::vector<double>& decays_ms);

}  // namespace palpate
