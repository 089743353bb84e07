// Metrics that compare a felt force with the reference, tick by tick (1 kHz).
//
//   snr_db          10 log10( sum |r - mean r|^2 / sum |f - r|^2 )
//   rel_rms         sqrt( sum |f - r|^2 / sum |r|^2 )
//   p95_rel_error   95th percentile of |f - r| / |r| over the ticks with |r| of at least a tenth of its peak
//   lag_ms          delay that brings r closest to f: argmin_d sum |f(t) - r(t - d)|^2, d from -50 to lag_max_ms (less than half
//                   the period of a periodic motion)
//   force_step_max  largest change of f between ticks beyond the reference's own, max(|f_n - f_n-1| - |r_n - r_n-1|, 0)
//   contact_ticks   ticks in which the body pushes on the tool, r != 0. At 0 the two never met: nothing is scored, and the other
//                   figures are meaningless
// with the felt force f and the reference force r, over the same ticks without the first `skip`.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct Fidelity {
  double snr_db = 0, rel_rms = 0, p95_rel_error = 0, force_step_max_n = 0;
  int lag_ms = 0;
  std::size_t contact_ticks = 0;
};

inline constexpr int kLagMaxMs = 1200;
inline constexpr double kSnrCeilingDb = 300;  ///< value for identical signals, instead of infinity

/// `felt` and `reference` have one entry per millisecond and the same length.
Fidelity compare(std::span<const Vec3> felt, std::span<const Vec3> reference, std::size_t skip, int lag_max_ms = kLagMaxMs);

/// Relative errors |f - r| / |r| of the ticks with |r| of at least a tenth of its peak.
std::vector<double> relative_errors(std::span<const Vec3> felt, std::span<const Vec3> reference);

/// Timing of contact onsets, felt against reference. An onset is the first tick of contact in the reference after kFreeTicks
/// without. Its error is the time of the display's nearest onset minus that of the reference: negative is early, positive late.
/// It is missed if there is none within kOnsetWithinMs.
struct OnsetErrors {
  int onsets = 0, missed = 0;
  int worst_ms = 0, median_ms = 0;  ///< over onsets not missed: the error of largest magnitude; the upper median, signed
};
inline constexpr int kFreeTicks = 100, kOnsetWithinMs = 700;
OnsetErrors onset_errors(std::span<const std::uint8_t> contact, std::span<const std::uint8_t> reference);

/// One hand-over between patches: the difference of the new patch's force from that of the one before, and the force at that
/// time.
struct HandOver {
  double step_n = 0, force_n = 0;
};

/// Largest unnoticeable step at a hand-over: 0.05 N, or 5 % of the force, half of the just-noticeable difference.
inline constexpr double kStepLimitN = 0.05, kStepLimitShare = 0.05;
/// Just-noticeable difference of force, as a share of the force.
inline constexpr double kForceJnd = 0.1;

struct HandOverSteps {
  std::size_t swaps = 0;
  double p50_n = 0, p999_n = 0, max_n = 0;
  double share_within = 1;  ///< share of swaps of at most max(kStepLimitN, kStepLimitShare |f|)
};
HandOverSteps hand_over_steps(std::span<const HandOver> swaps);

/// Value below which `share` (0 to 1) of the values lie; 0 if there are none.
double percentile(std::vector<double> values, double share);

}  // namespace palpate
