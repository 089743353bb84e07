#include "bench/paper/spring1d.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <unsupported/Eigen/FFT>

#include "bench/fidelity/metrics.hpp"
#include "common/mechanics/spring_law.hpp"

namespace palpate {
namespace {

constexpr double kSpringTickS = 1.0 / kHapticRateHz, kFeltN = 0.1;
constexpr std::size_t kOnsetTicks = 100;

double rounded(double value, double step) { return step > 0 ? std::round(value / step) * step : value; }

/// Newest frame of every tick, as the tick in which its position was read.
std::vector<std::size_t> frame_ticks(std::size_t ticks, double rate_hz) {
  std::vector<std::size_t> at(ticks);
  double shown = -1;
  for (std::size_t n = 0; n < ticks; ++n) {
    const double frame = std::floor(static_cast<double>(n) * rate_hz * kSpringTickS + 1e-9);
    at[n] = frame > shown ? n : at[n - 1];
    shown = frame;
  }
  return at;
}

/// Displayed force before rounding.
std::vector<double> shown_force(SpringScheme scheme, const std::vector<double>& x, const std::vector<std::size_t>& frame,
                                double low_pass_hz) {
  const double gain = 1 - std::exp(-2 * std::numbers::pi * low_pass_hz * kSpringTickS);
  std::vector<double> shown(x.size());
  double filtered = thigh_spring(x.front()).force_n;
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double at = x[frame[n]];
    const SpringForce f = thigh_spring(at);
    filtered += gain * (f.force_n - filtered);
    switch (scheme) {
      case SpringScheme::ideal:
        shown[n] = thigh_spring(x[n]).force_n;
        break;
      case SpringScheme::hold:
        shown[n] = f.force_n;
        break;
      case SpringScheme::filtered:
        shown[n] = filtered;
        break;
      case SpringScheme::tangent:
        shown[n] = std::max(0.0, f.force_n + f.slope_n_mm * (x[n] - at));
        break;
      case SpringScheme::surface:
        // In contact, the tangent's zero is not the surface: the displayed force ends at whichever comes first.
        if (x[n] > 0)
          shown[n] = at > 0 ? std::max(0.0, f.force_n + f.slope_n_mm * (x[n] - at)) : thigh_spring(1e-9).slope_n_mm * x[n];
        break;
    }
  }
  return shown;
}

std::vector<Vec3> along_z(const std::vector<double>& values) {
  std::vector<Vec3> out;
  out.reserve(values.size());
  for (const double v : values) out.emplace_back(0, 0, v);
  return out;
}

/// Part above half the frame rate: everything except the Fourier terms up to there. Exact if the stroke is periodic in the given
/// time.
std::vector<double> fast_part(const std::vector<double>& values, double rate_hz) {
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> terms;
  fft.fwd(terms, values);
  const std::size_t n = values.size(), slow = static_cast<std::size_t>(rate_hz / 2 * static_cast<double>(n) * kSpringTickS);
  for (std::size_t k = 0; k < n; ++k)
    if (std::min(k, n - k) <= slow) terms[k] = 0;
  std::vector<double> fast;
  fft.inv(fast, terms);
  return fast;
}

double regression(std::span<const double> shown, std::span<const double> reference) {
  double product = 0, power = 0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    product += shown[i] * reference[i];
    power += reference[i] * reference[i];
  }
  return power > 0 ? product / power : 0;
}

/// Number of ticks from `at` on until `reached` holds.
template <class Reached>
std::size_t ticks_until(std::size_t at, std::size_t end, const Reached& reached) {
  std::size_t n = at;
  while (n < end && !reached(n)) ++n;
  return n - at;
}

/// Overlap of two series of which one is late by `lag` ticks: (start in the late one, start in the other, length).
struct Overlap {
  std::size_t late, early, length;
  Overlap(int lag, std::size_t n)
      : late(static_cast<std::size_t>(std::max(0, lag))),
        early(static_cast<std::size_t>(std::max(0, -lag))),
        length(n - late - early) {}
};

void onset_figures(const Spring1d& run, const std::vector<double>& shown, SpringFigures& figures) {
  const std::vector<double>&x = run.position_mm, &reference = run.reference_n;
  const std::size_t end = x.size();
  double delays = 0, squares = 0, ticks = 0;
  int touches = 0;
  for (std::size_t n = 1; n < end; ++n) {
    if (x[n] <= 0) figures.ghost_force_n = std::max(figures.ghost_force_n, shown[n]);
    if (x[n] <= 0 && x[n - 1] > 0) {
      const auto on = static_cast<double>(ticks_until(n, end, [&](std::size_t i) { return shown[i] < kFeltN || x[i] > 0; }));
      figures.ghost_ms_max = std::max(figures.ghost_ms_max, on * kSpringTickS * 1e3);
    }
    if (reference[n] < kFeltN || reference[n - 1] >= kFeltN) continue;
    ++touches;
    const double late =
        1e3 * kSpringTickS * static_cast<double>(ticks_until(n, end, [&](std::size_t i) { return shown[i] >= kFeltN; }));
    delays += late;
    figures.onset_ms_max = std::max(figures.onset_ms_max, late);
    for (std::size_t i = n; i < std::min(end, n + kOnsetTicks); ++i, ++ticks)
      squares += (shown[i] - reference[i]) * (shown[i] - reference[i]);
  }
  if (touches == 0) return;
  figures.onset_ms_mean = delays / touches;
  figures.onset_error_n = std::sqrt(squares / ticks);
}

SpringFigures figures_of(const Spring1d& run, const std::vector<double>& shown, const Spring1dOptions& o) {
  const std::vector<Vec3> f = along_z(shown), r = along_z(run.reference_n);
  const double half_period_ms = 500 / o.frequency_hz, frames_ms = 3000 / o.rate_hz;
  const Fidelity as_shown = compare(f, r, 0, static_cast<int>(std::min(half_period_ms, frames_ms)));
  SpringFigures figures;
  figures.lag_ms = as_shown.lag_ms;
  figures.snr_unshifted_db = as_shown.snr_db;
  const Overlap both(figures.lag_ms, f.size());
  figures.snr_db =
      compare(std::span(f).subspan(both.late, both.length), std::span(r).subspan(both.early, both.length), 0, 0).snr_db;
  figures.snr_paper_db = 2 * figures.snr_db;
  if (run.touches == 0) return figures;
  const std::vector<double> fast = fast_part(shown, o.rate_hz), fast_reference = fast_part(run.reference_n, o.rate_hz);
  figures.fast_kept =
      regression(std::span(fast).subspan(both.late, both.length), std::span(fast_reference).subspan(both.early, both.length));
  onset_figures(run, shown, figures);
  return figures;
}

int count_touches(const std::vector<double>& x) {
  int touches = 0;
  for (std::size_t n = 1; n < x.size(); ++n) touches += x[n] > 0 && x[n - 1] <= 0;
  return touches;
}

}  // namespace

Spring1dOptions tapping(Spring1dOptions options) {
  options.middle_mm = 4;
  options.amplitude_mm = 14;
  options.frequency_hz = 0.95;
  return options;
}

SpringForce thigh_spring(double x_mm) {
  if (x_mm <= 0) return {};
  // The law scales with the stiffness at rest; this one makes the scale 1.
  double tension_n, slope_n_m;
  ThighSkinSpring{}.respond(1e3 / ThighSkinSpring::kP, x_mm * 1e-3, tension_n, slope_n_m);
  return {tension_n, slope_n_m * 1e-3};
}

Spring1d run_spring1d(const Spring1dOptions& o) {
  Spring1d run;
  const auto ticks = static_cast<std::size_t>(std::lround(o.duration_s * kHapticRateHz));
  std::vector<double> measured;
  for (std::size_t n = 0; n < ticks; ++n) {
    const double t = static_cast<double>(n) * kSpringTickS;
    const double x = o.middle_mm + o.amplitude_mm * std::sin(2 * std::numbers::pi * o.frequency_hz * t + o.phase_rad);
    run.position_mm.push_back(x);
    run.reference_n.push_back(thigh_spring(x).force_n);
    measured.push_back(rounded(x, o.position_step_mm));
  }
  run.touches = count_touches(run.position_mm);
  const std::vector<std::size_t> frame = frame_ticks(ticks, o.rate_hz);
  for (std::size_t s = 0; s < run.shown_n.size(); ++s) {
    run.shown_n[s] = shown_force(static_cast<SpringScheme>(s), measured, frame, o.low_pass_hz);
    for (double& f : run.shown_n[s]) f = rounded(f, o.force_step_n);
    run.figures[s] = figures_of(run, run.shown_n[s], o);
  }
  return run;
}

double ideal_snr_db(const Spring1d& run, double position_step_mm, double force_step_n) {
  const auto n = static_cast<double>(run.reference_n.size());
  double mean = 0, power = 0, slope_squared = 0;
  for (const double r : run.reference_n) mean += r / n;
  for (std::size_t i = 0; i < run.reference_n.size(); ++i) {
    power += (run.reference_n[i] - mean) * (run.reference_n[i] - mean) / n;
    const double slope = thigh_spring(run.position_mm[i]).slope_n_mm;
    slope_squared += slope * slope / n;
  }
  const double noise = (force_step_n * force_step_n + slope_squared * position_step_mm * position_step_mm) / 12;
  return 10 * std::log10(power / noise);
}

}  // namespace palpate
