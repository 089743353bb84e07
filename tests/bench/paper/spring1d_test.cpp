#include "bench/paper/spring1d.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace palpate;

namespace {

const SpringFigures& of(const Spring1d& run, SpringScheme s) { return run.figures[static_cast<std::size_t>(s)]; }
const std::vector<double>& shown(const Spring1d& run, SpringScheme s) { return run.shown_n[static_cast<std::size_t>(s)]; }

Spring1dOptions exact() {
  Spring1dOptions o;
  o.position_step_mm = o.force_step_n = 0;
  return o;
}

}  // namespace

TEST_CASE("the spring is equation 5 and its slope the derivative", "[paper]") {
  for (const double x : {0.01, 1.0, 7.5, 22.0, 34.0}) {
    CHECK(thigh_spring(x).force_n == Approx(x / (5.4398 - 0.1418 * x)).epsilon(1e-12));
    const double h = 1e-5, difference = (thigh_spring(x + h).force_n - thigh_spring(x - h).force_n) / (2 * h);
    CHECK(thigh_spring(x).slope_n_mm == Approx(difference).epsilon(1e-6));
  }
  CHECK(thigh_spring(-3).force_n == 0);
  CHECK(std::isfinite(thigh_spring(5.4398 / 0.1418).force_n));
}

TEST_CASE("the paper's table comes out within 3 dB and 2 ms", "[paper]") {
  const Spring1d run = run_spring1d({});
  CHECK(of(run, SpringScheme::ideal).snr_paper_db == Approx(89).margin(3));
  CHECK(of(run, SpringScheme::hold).snr_paper_db == Approx(43).margin(3));
  CHECK(of(run, SpringScheme::filtered).snr_paper_db == Approx(53).margin(3));
  CHECK(of(run, SpringScheme::tangent).snr_paper_db == Approx(72).margin(3));
  CHECK(of(run, SpringScheme::ideal).lag_ms == 0);
  CHECK(std::abs(of(run, SpringScheme::hold).lag_ms - 49) <= 2);
  CHECK(std::abs(of(run, SpringScheme::filtered).lag_ms - 65) <= 2);
  CHECK(of(run, SpringScheme::tangent).lag_ms == 0);
}

TEST_CASE("rounding costs what uniform errors of its size cost", "[paper]") {
  for (const double step : {0.003, 0.03, 0.3}) {
    Spring1dOptions o;
    o.position_step_mm = step;
    const Spring1d run = run_spring1d(o);
    CHECK(of(run, SpringScheme::ideal).snr_db == Approx(ideal_snr_db(run, step, o.force_step_n)).margin(0.5));
  }
}

TEST_CASE("a held force is late by half a frame, a filtered one by its time constant more", "[paper]") {
  for (const double rate_hz : {5.0, 10.0, 40.0}) {
    Spring1dOptions o = exact();
    o.rate_hz = rate_hz;
    const Spring1d run = run_spring1d(o);
    CHECK(std::abs(of(run, SpringScheme::hold).lag_ms - 500 / rate_hz) <= 1);
    CHECK(std::abs(of(run, SpringScheme::filtered).lag_ms - (500 / rate_hz + 1e3 / (2 * std::numbers::pi * o.low_pass_hz))) <= 2);
  }
}

TEST_CASE("the tangent is off by no more than the spring's curvature allows", "[paper]") {
  const Spring1dOptions o = exact();
  const Spring1d run = run_spring1d(o);
  const double deepest = o.middle_mm + o.amplitude_mm, p = 5.4398, q = 0.1418;
  const double curvature = 2 * p * q / std::pow(p - q * deepest, 3);  // f'' grows with x
  const double way = 2 * std::numbers::pi * o.frequency_hz * o.amplitude_mm / o.rate_hz;
  double most = 0;
  for (std::size_t n = 0; n < run.reference_n.size(); ++n)
    most = std::max(most, std::abs(shown(run, SpringScheme::tangent)[n] - run.reference_n[n]));
  CHECK(most <= 0.5 * curvature * way * way);
  CHECK(most > 0);
}

TEST_CASE("a model as fast as the hand's loop is the spring itself in every scheme but the filtered", "[paper]") {
  Spring1dOptions o = tapping(exact());
  o.rate_hz = 1000;
  const Spring1d run = run_spring1d(o);
  for (const SpringScheme s : {SpringScheme::ideal, SpringScheme::hold, SpringScheme::tangent, SpringScheme::surface})
    CHECK(shown(run, s) == run.reference_n);
}

TEST_CASE("in and out of contact held forces come late and outstay, filtered ones most", "[paper]") {
  const Spring1dOptions o = tapping({});
  const Spring1d run = run_spring1d(o);
  CHECK(run.touches == 19);
  const SpringFigures hold = of(run, SpringScheme::hold), filtered = of(run, SpringScheme::filtered),
                      tangent = of(run, SpringScheme::tangent), surface = of(run, SpringScheme::surface);
  // Touches begin anywhere in a frame.
  CHECK(hold.onset_ms_mean == Approx(50).margin(5));
  CHECK(hold.onset_ms_max <= 100);
  CHECK(filtered.onset_ms_mean > hold.onset_ms_mean);
  CHECK(filtered.ghost_ms_max >= hold.ghost_ms_max);
  CHECK(filtered.snr_unshifted_db < hold.snr_unshifted_db);
  CHECK(filtered.fast_kept < hold.fast_kept);
  // The tangent pushes only while the tool is inside, but learns of that from the next frame.
  CHECK(tangent.ghost_force_n == 0);
  CHECK(tangent.onset_ms_mean > 40);
  CHECK(surface.onset_ms_max <= 2);
  CHECK(surface.onset_error_n < 0.25 * tangent.onset_error_n);
}

TEST_CASE("the same options give the same bits", "[paper]") {
  const Spring1d a = run_spring1d(tapping({})), b = run_spring1d(tapping({}));
  CHECK(a.shown_n == b.shown_n);
  CHECK(a.figures[2].fast_kept == b.figures[2].fast_kept);
}
