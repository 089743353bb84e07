// The verdict on motions of known course.
#include "bench/measure/stability.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

using namespace palpate;

namespace {

constexpr double kOmega = 2 * M_PI / kWindowS * 2;  // two oscillations per window

/// An oscillation of 75 g along x whose amplitude [m] is a slow function of time.
StabilityVerdict swing(const std::function<double(double)>& amplitude, double duration_s = 2.4, bool lost = false) {
  std::vector<Vec3> position;
  std::vector<double> kinetic_j;
  for (int i = 0; i < static_cast<int>(duration_s * 1000 + 0.5); ++i) {
    const double t = i * 1e-3, a = amplitude(t);
    position.emplace_back(0.04 + a * std::sin(kOmega * t), 0.04, 0.1);
    kinetic_j.push_back(0.5 * 0.075 * std::pow(a * kOmega * std::cos(kOmega * t), 2));
  }
  return judge_motion(position, kinetic_j, lost);
}

}  // namespace

TEST_CASE("A motion that dies out is stable, and how fast it does is the rate of its exponential") {
  const StabilityVerdict v = swing([](double t) { return 0.004 * std::exp(-1.5 * t); });
  CHECK(v.stable);
  CHECK(v.peak_to_peak_m.size() == 8);
  CHECK(v.peak_to_peak_m[0] == Approx(0.008).epsilon(0.2));
  CHECK(v.growth_1_s == Approx(-1.5).epsilon(1e-3));
  CHECK(v.kinetic_max_j[0] == Approx(0.5 * 0.075 * std::pow(0.004 * kOmega, 2)).epsilon(1e-3));
}

TEST_CASE("A swing without end, one that grows, and one that takes longer than was looked at are not stable") {
  CHECK_FALSE(swing([](double) { return 0.002; }).stable);
  CHECK(swing([](double) { return 0.002; }).growth_1_s == Approx(0).margin(1e-9));
  const StabilityVerdict grows = swing([](double t) { return 1e-4 * std::exp(t); });
  CHECK_FALSE(grows.stable);
  CHECK(grows.growth_1_s == Approx(1).epsilon(1e-3));
  CHECK_FALSE(swing([](double t) { return 0.004 * std::exp(-0.5 * t); }).stable);
}

TEST_CASE("What never moves more than the device can read is at rest") {
  const StabilityVerdict v = swing([](double) { return 1e-5; });
  CHECK(v.stable);
  CHECK(v.growth_1_s == 0);
}

TEST_CASE("A tool that was lost is not stable, however little it had moved before") {
  const StabilityVerdict v = swing([](double) { return 1e-5; }, 0.45, true);
  CHECK_FALSE(v.stable);
  CHECK(v.peak_to_peak_m.size() == 2);
  CHECK_FALSE(swing([](double t) { return 0.004 * std::exp(-20 * t); }, 0.2, true).stable);
}

TEST_CASE("A window that is not whole is left out") {
  CHECK(swing([](double) { return 0.001; }, 1.05).peak_to_peak_m.size() == 3);
  CHECK(swing([](double) { return 0.001; }, 0.1).peak_to_peak_m.size() == 1);
}
