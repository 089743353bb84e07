// How true a force is: figures that compare what was felt with the reference, tick by tick (1 kHz).
//
//   snr_db          10 log10( sum |r - mean r|^2 / sum |f - r|^2 )
//   rel_rms         sqrt( sum |f - r|^2 / sum |r|^2 )
//   p95_rel_error   95th percentile of |f - r| / |r| over the ticks with |r| of at least a tenth of its peak
//   lag_ms          the delay that brings r closest to f: argmin_d sum |f(t) - r(t - d)|^2, d from -50 to lag_max_ms (below half
//   a
//                   period of a motion that repeats itself)
//   force_step_max  largest change of f between ticks beyond the reference's own, max(|f_n - f_n-1| - |r_n - r_n-1|, 0)
// f felt force, r reference force. All over the same ticks, the first `skip` left out.
#pragma once

#include <span>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct Fidelity {
  double snr_db = 0, rel_rms = 0, p95_rel_error = 0, force_step_max_n = 0;
  int lag_ms = 0;
};

inline constexpr int kLagMaxMs = 1200;
inline constexpr double kSnrCeilingDb = 300;  ///< what identical signals get: rounding, not infinity

/// `felt` and `reference` have one entry a millisecond and the same length.
Fidelity compare(std::span<const Vec3> felt, std::span<const Vec3> reference, std::size_t skip, int lag_max_ms = kLagMaxMs);

/// The value below which `share` (0 to 1) of the values lie; 0 for none.
double percentile(std::vector<double> values, double share);

}  // namespace palpate
