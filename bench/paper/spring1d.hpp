// Section 2 of the paper: a hand on one nonlinear spring, displayed at 1 kHz by models that evaluate the spring at a low rate.
//
//     ideal     f(x[n])                                     eq. 1
//     hold      f(x[N])                                     eq. 2
//     filtered  f(x[N]) through a first-order low-pass      eq. 3
//     tangent   f(x[N]) + f'(x[N]) (x[n] - x[N])            eq. 4
//     surface   tangent, but the surface stays known between frames: while the last frame was free of contact, the spring that
//               begins at x = 0 is displayed along its tangent there (the anticipating patch of `touch`); not in the paper
//
// n haptic samples (1 kHz), N the newest frame's. f(x) = x / (5.4398 - 0.1418 x) (eq. 5, x in mm, f in N) for x > 0, the skin of
// the thigh, along its tangent near the pole (SpringLaw::thigh_skin); no force for x <= 0: the surface is at x = 0, and a model
// only pushes. x[n] is the hand's position rounded to `position_step_mm`, the displayed force is rounded to `force_step_n`; the
// reference is f of the exact position, not rounded. The low-pass is that of the client: y += (1 - exp(-2 pi f_c T)) (u - y).
//
// Two ratios are computed, after shifting the displayed force back by its lag (the shift of least squared error):
//     snr_db       = 10 log10( sum |r - mean r|^2 / sum |f - r|^2 ),  the usual one
//     snr_paper_db = 20 log10 of the same ratio of powers, twice as large: this gives the paper's numbers
#pragma once

#include <array>
#include <vector>

#include "common/base/limits.hpp"
#include "common/base/types.hpp"

namespace palpate {

enum class SpringScheme : std::size_t { ideal, hold, filtered, tangent, surface };
inline constexpr std::array<const char*, 5> kSpringSchemeNames = {"ideal", "hold", "filtered", "tangent", "surface"};
inline constexpr std::size_t kPaperSpringSchemes = 4;  ///< the first four

struct Spring1dOptions {
  // Path of the hand: x(t) = middle + amplitude sin(2 pi frequency t + phase); stays in contact if the amplitude is below the
  // middle.
  double middle_mm = 12, amplitude_mm = 10, frequency_hz = 0.45, phase_rad = 0.3;
  double duration_s = 20;
  double rate_hz = 10;             ///< frames of the model per second, up to 1000
  double low_pass_hz = 10;         ///< cut-off frequency of `filtered`
  double position_step_mm = 0.03;  ///< resolution of the Phantom 1.5; the paper prints 0.3
  double force_step_n = 0.07;      ///< 0 = not rounded
};

/// Options of a stroke that leaves the surface and returns: 19 touches in 20 s, at 80 mm/s, each at another phase between two
/// frames.
Spring1dOptions tapping(Spring1dOptions options);

struct SpringFigures {
  double snr_db = 0, snr_paper_db = 0;
  double snr_unshifted_db = 0;  ///< without the shift by the lag
  int lag_ms = 0;
  // For a stroke that leaves the surface, over all touches; else 0. Delays from the reference passing 0.1 N to the displayed
  // force doing so.
  double onset_ms_mean = 0, onset_ms_max = 0;
  double ghost_ms_max = 0;   ///< longest time for which a force is displayed after it ended
  double ghost_force_n = 0;  ///< largest force displayed while the tool is free
  double onset_error_n = 0;  ///< rms error in the 100 ms after the onset of contact
  /// Displayed share of the reference above half the frame rate, as a regression coefficient, without the lag.
  double fast_kept = 0;
};

struct Spring1d {
  std::vector<double> position_mm, reference_n;  ///< exact, one per millisecond
  std::array<std::vector<double>, kSpringSchemeNames.size()> shown_n;
  std::array<SpringFigures, kSpringSchemeNames.size()> figures;
  int touches = 0;
};

/// f(x) and f'(x) [N], [N/mm].
struct SpringForce {
  double force_n = 0, slope_n_mm = 0;
};
SpringForce thigh_spring(double x_mm);

/// Options must be in the ranges that the command line checks.
Spring1d run_spring1d(const Spring1dOptions& options);

/// snr_db of `ideal` in closed form, for steps that are small compared with the motion: rounding errors are uniform and
/// independent, with error power force_step^2 / 12 + mean(f'^2) position_step^2 / 12.
double ideal_snr_db(const Spring1d& run, double position_step_mm, double force_step_n);

}  // namespace palpate
