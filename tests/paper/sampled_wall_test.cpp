#include "bench/paper/sampled_wall.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace palpate;

namespace {

bool stable(const WallLoop& loop) { return spectral_radius(loop) < 1; }

WallLoop wall(double mass_kg, double damping_n_s_m, double k, double b = 0) {
  WallLoop loop;
  loop.device = {mass_kg, damping_n_s_m, 0};
  loop.stiffness_n_m = k;
  loop.damping_n_s_m = b;
  return loop;
}

}  // namespace

TEST_CASE("the eigenvalues of an undamped mass on a sampled spring are those of its closed form", "[paper]") {
  // x+ = x + T v - T^2 K x / (2 m), v+ = v - T K x / m:  z^2 - (2 - a) z + (1 + a) = 0 with a = K T^2 / (2 m): always unstable.
  const WallLoop loop = wall(0.1, 0, 400);
  const double a = 400 * 1e-6 / 0.2;
  CHECK(spectral_radius(loop) == Approx(std::sqrt(1 + a)).epsilon(1e-12));
  CHECK_FALSE(settles(loop, 5000));
}

TEST_CASE("a device between samples moves as its differential equation says", "[paper]") {
  const Device1d device{0.075, 0.5, 200};
  double x = 1e-3, v = 0.1, y = x, w = v;
  DeviceStep(device, 1e-3).advance(0.7, x, v);
  constexpr int kSteps = 100000;
  for (int k = 0; k < kSteps; ++k) {  // midpoint rule
    const double h = 1e-3 / kSteps, a = (0.7 - 0.5 * w - 200 * y) / 0.075, ym = y + h / 2 * w, wm = w + h / 2 * a;
    y += h * wm;
    w += h * (0.7 - 0.5 * wm - 200 * ym) / 0.075;
  }
  CHECK(x == Approx(y).epsilon(1e-10));
  CHECK(v == Approx(w).epsilon(1e-10));
}

TEST_CASE("the simulated boundary of stability is that of the eigenvalues", "[paper]") {
  for (const double b : {0.0, 0.2, 0.6}) {
    const double by_eigenvalues = stiffest(wall(0.075, 0.5, 0, b), 1e5, stable);
    CHECK(stiffest(wall(0.075, 0.5, 0, b), 1e5, [](const WallLoop& l) { return settles(l, 20000); }) ==
          Approx(by_eigenvalues).epsilon(1e-3));
    // For a heavy device, whose motion within a period is small: b + B = K T / 2.
    CHECK(stiffest(wall(50, 0.5, 0, b), 1e5, stable) == Approx(2 * (0.5 + b) / 1e-3).epsilon(1e-3));
  }
}

TEST_CASE("no lossless spring makes a passive wall oscillate, and the worst comes as near as its harmonic allows", "[paper]") {
  for (const double b : {0.0, 0.1, 0.3, 0.45}) {
    WallLoop loop = wall(0.075, 0.5, 0, b);
    const double worst = stiffest_for_any_spring(loop, 1e5, 20);
    CHECK(worst >= passive_wall_n_m(loop));
    const double pi = std::numbers::pi, harmonic = 2 * (pi * pi / 8 * 0.5 - b) / 1e-3, free = 2 * (0.5 + b) / 1e-3;
    CHECK(worst == Approx(std::min(harmonic, free)).epsilon(5e-3));
  }
}

TEST_CASE("halving the sampling period doubles the stiffest wall", "[paper]") {
  WallLoop slow = wall(0.5, 0.5, 0), fast = slow;
  fast.period_s = slow.period_s / 2;
  CHECK(stiffest(fast, 1e6, stable) == Approx(2 * stiffest(slow, 1e6, stable)).epsilon(1e-2));
}

TEST_CASE("a passive virtual coupling is stable on any environment, one that is too stiff is not", "[paper]") {
  WallLoop loop = wall(0.075, 0.5, 0);
  const double limit = passive_stiffness_n_m(0.5, 0.1, 1e-3);
  CHECK(limit == Approx(800));
  for (const double environment : {1.0, 1e3, 1e5, 1e8}) {
    loop.stiffness_n_m = environment;
    loop.coupling = CouplingParameters{0.95 * limit, 0.1, 0};
    CHECK(stable(loop));
    loop.coupling->tool_mass_kg = 0.01;
    CHECK(stable(loop));
  }
  loop.coupling = CouplingParameters{5 * limit, 0.1, 0};
  CHECK_FALSE(stable(loop));
  CHECK_FALSE(settles(loop, 20000));
}

TEST_CASE("through a coupling at rest the hand meets coupling and environment in series", "[paper]") {
  const CouplingParameters coupling{600, 0.2, 0.01};
  const double environment = 300, depth = 0.004;
  VirtualTool tool;
  Vec3 force = Vec3::Zero();
  for (int n = 0; n < 20000; ++n)
    force = couple(coupling, tool, {0, 0, -depth}, {-environment * tool.position, environment}, 1e-3);
  CHECK(force.z() == Approx(depth / (1 / 600.0 + 1 / environment)).epsilon(1e-9));
  CHECK(tool.position.z() == Approx(-depth * 600 / (600 + environment)).epsilon(1e-9));
  CHECK(force.head<2>().norm() == 0);
}
