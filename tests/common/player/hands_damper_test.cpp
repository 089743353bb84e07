// What keeps several hands on one body calm, against closed forms: how much of a hand's motion is predictable, and the damper.
#include "client/core/hands_damper.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "tests/common/player/floor_patch.hpp"

using namespace palpate;
using test::pressed_floor;

namespace {

constexpr double kRadiusM = 0.003;

Vec3 on_circle(double omega_rad_s, double t_s) {
  return kRadiusM * Vec3(std::cos(omega_rad_s * t_s), std::sin(omega_rad_s * t_s), 0);
}

/// Least-squares gain of x + h v on a circle, whose sums are those of a single moment.
double share_on_circle(double omega_rad_s, double horizon_s) {
  constexpr double kStepS = 0.03;
  using namespace std::complex_literals;
  const auto late = [&](double by_s) { return std::exp(-1i * omega_rad_s * by_s); };
  const auto expected = horizon_s * (3.0 - 4.0 * late(kStepS) + late(2 * kStepS)) / (2 * kStepS) * late(horizon_s);
  return std::clamp(std::real(std::conj(expected) * (1.0 - late(horizon_s))) / std::norm(expected), 0.0, 1.0);
}

/// Two tools on two modes, 7 and 3 of which they move along the normal.
Patch two_tools() {
  Patch p = pressed_floor(Eigen::RowVector2d(7, 3));
  p.stiffness << 5000, 9000;
  p.c_static = 2e-4 * Mat3::Identity();
  p.contact_stiffness_n_m = 800;
  p.others.count = 1;
  OtherTool& other = p.others.of[0];
  other.normal = Vec3::UnitZ();
  other.rows = PortRows::Zero(3, 2);
  other.rows.row(2) << 6, -1;
  other.c_static = 3e-4 * Mat3::Identity();
  return p;
}

}  // namespace

TEST_CASE("A steady motion is predictable as a whole, a circle as far as its radius and the horizon say") {
  Predictability line;
  CHECK(line.share() == 1);
  for (int k = 0; k < 100; ++k) line.add(Vec3(1e-4 * k, 0, 2e-4 * k), 0.1);
  CHECK(line.share() == Approx(1).margin(1e-9));
  const double hz = GENERATE(0.7, 1.5, 3.0, 5.0), horizon_s = GENERATE(0.05, 0.1, 0.25);
  CAPTURE(hz, horizon_s);
  Predictability circle;
  for (int k = 0; k < 200; ++k) circle.add(on_circle(2 * M_PI * hz, 0.01 * k), horizon_s);
  CHECK(circle.share() == Approx(share_on_circle(2 * M_PI * hz, horizon_s)).margin(1e-9));
  // Of a slow motion all, of a fast one nothing that would make it larger.
  if (hz * horizon_s < 0.05) CHECK(circle.share() > 0.9);
  if (hz * horizon_s > 0.5) CHECK(circle.share() < 0.1);
}

TEST_CASE("Predictability forgets how the hand moved before") {
  Predictability hand;
  for (int k = 0; k < 200; ++k) hand.add(on_circle(2 * M_PI * 5, 0.01 * k), 0.1);
  CHECK(hand.share() < 0.1);
  for (int k = 0; k < 200; ++k) hand.add(Vec3(1e-3 * k, 0, 0), 0.1);
  CHECK(hand.share() > 0.95);
}

TEST_CASE("The stiffness between two tools is that of the flexibility matrix of modes, surface and contacts, inverted") {
  const Patch p = two_tools();
  Eigen::Matrix2d modes, flexibility = Eigen::Matrix2d::Zero();
  modes << 7, 3, 6, -1;
  for (int mode = 0; mode < 2; ++mode) flexibility += modes.col(mode) * modes.col(mode).transpose() / p.stiffness[mode];
  flexibility(0, 0) += 2e-4 + 1.0 / 800;
  flexibility(1, 1) += 3e-4 + 1.0 / 800;
  const Eigen::Matrix2d stiffness = flexibility.inverse();
  CHECK(stiffness_between_tools(p) == Approx(std::abs(stiffness(0, 1))).epsilon(1e-9));
  Patch alone = p;
  alone.others.count = 0;
  CHECK(stiffness_between_tools(alone) == 0);
}

TEST_CASE("A hand that swings beside another is damped by 0.7 (1 - s) T K, one that moves smoothly or alone is not") {
  const Patch p = two_tools();
  constexpr double kOmega = 2 * M_PI * 5, kAgeS = 0.1, kDtS = 1e-3;
  HandsDamper damper, alone, smooth;
  Patch without = p;
  without.others.count = 0;
  damper.play(p);
  alone.play(without);
  smooth.play(p);
  Vec3 force;
  double work_j = 0, worst_alone_n = 0;
  for (int ms = 0; ms <= 3000; ++ms) {
    const Vec3 here = on_circle(kOmega, ms * kDtS);
    if (ms > 1000) work_j += force.dot(here - on_circle(kOmega, (ms - 1) * kDtS));
    force = damper.tick(here, true, kAgeS, kDtS);
    worst_alone_n = std::max(worst_alone_n, alone.tick(here, true, kAgeS, kDtS).norm());
  }
  const double damping = 0.7 * (1 - share_on_circle(kOmega, kAgeS)) * kAgeS * stiffness_between_tools(p);
  REQUIRE(damping < HandsDamper::kMostNSM);
  const double part = kDtS / (HandsDamper::kFilterS + kDtS);
  const double passes = part / std::abs(1.0 - (1 - part) * std::exp(std::complex<double>(0, -kOmega * kDtS)));
  CHECK(force.norm() == Approx(damping * passes * 2 * kRadiusM * std::sin(kOmega * kDtS / 2) / kDtS).epsilon(1e-6));
  CHECK(work_j < 0);
  CHECK(worst_alone_n == 0);
  for (int ms = 0; ms <= 1000; ++ms) force = smooth.tick(Vec3(5e-5 * ms, 0, 0), true, kAgeS, kDtS);
  CHECK(force.norm() < 1e-9);
}

TEST_CASE("The damper is bounded, ends where the tool leaves the body, and starts anew after a pause") {
  HandsDamper damper;
  Patch stiff = two_tools();
  stiff.stiffness *= 100;
  stiff.contact_stiffness_n_m = 0;
  stiff.c_static.setZero();
  stiff.others.of[0].c_static.setZero();
  stiff.others.of[0].rows.row(2) << 7, 2.9;
  damper.play(stiff);
  double most_n = 0;
  const auto swing = [&](int ms) { return on_circle(2 * M_PI * 5, 1e-3 * ms); };
  for (int ms = 0; ms < 2000; ++ms) most_n = std::max(most_n, damper.tick(swing(ms), true, 1, 1e-3).norm());
  CHECK(most_n <= HandsDamper::kMostNSM * kRadiusM * 2 * M_PI * 5);
  CHECK(most_n > 0.9 * HandsDamper::kMostNSM * kRadiusM * 2 * M_PI * 5);
  CHECK(damper.tick(swing(2000), false, 1, 1e-3).norm() == 0);
  damper.restart();
  damper.play(stiff);
  CHECK(damper.tick(swing(0), true, 1, 1e-3).norm() == 0);
}
