// How true a force is: figures that compare what was felt with the reference, tick by tick (1 kHz).
//
//   snr_db          10 log10( sum |r - mean r|^2 / sum |f - r|^2 )
//   rel_rms         sqrt( sum |f - r|^2 / sum |r|^2 )
//   p95_rel_error   95th percentile of |f - r| / |r| over the ticks with |r| of at least a tenth of its peak
//   lag_ms          the delay that brings r closest to f: argmin_d sum |f(t) - r(t - d)|^2, d from -50 to lag_max_ms (below half
//   a
//                   period of a motion that repeats itself)
//   force_step_max  largest change of f between ticks beyond the reference's own, max(|f_n - f_n-1| - |r_n - r_n-1|, 0)
//   contact_ticks   ticks in which the body pushes on the tool, r != 0. At 0 the two never met: nothing is scored then, the other
//                   figures say nothing
// f felt force, r reference force. All over the same ticks, the first `skip` left out.
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
inline constexpr double kSnrCeilingDb = 300;  ///< what identical signals get: rounding, not infinity

/// `felt` and `reference` have one entry a millisecond and the same length.
Fidelity compare(std::span<const Vec3> felt, std::span<const Vec3> reference, std::size_t skip, int lag_max_ms = kLagMaxMs);

/// |f - r| / |r| of the ticks with |r| of at least a tenth of its peak.
std::vector<double> relative_errors(std::span<const Vec3> felt, std::span<const Vec3> reference);

/// When contact begins, felt against true. An onset is the first tick of contact in the reference after kFreeTicks without; its
/// error is the display's own onset nearest to it minus it: negative is early, positive late. Missed: none within kOnsetWithin.
struct OnsetErrors {
  int onsets = 0, missed = 0;
  int worst_ms = 0, median_ms = 0;  ///< of those not missed: the one largest in size; the upper median, signed
};
inline constexpr int kFreeTicks = 100, kOnsetWithinMs = 700;
OnsetErrors onset_errors(std::span<const std::uint8_t> contact, std::span<const std::uint8_t> reference);

/// One swap of patches: how far the new patch's force lies from the one shown before, and the force shown then.
struct HandOver {
  double step_n = 0, force_n = 0;
};

/// What a hand is not to notice at a swap: 0.05 N, or 5 % of the force, half of what it can just tell.
inline constexpr double kStepLimitN = 0.05, kStepLimitShare = 0.05;
/// The just-noticeable difference of force, as a share of it.
inline constexpr double kForceJnd = 0.1;

struct HandOverSteps {
  std::size_t swaps = 0;
  double p50_n = 0, p999_n = 0, max_n = 0;
  double share_within = 1;  ///< of the swaps, those of at most max(kStepLimitN, kStepLimitShare |f|)
};
HandOverSteps hand_over_steps(std::span<const HandOver> swaps);

/// The value below which `share` (0 to 1) of the values lie; 0 for none.
double percentile(std::vector<double> values, double share);

}  // namespace palpate
