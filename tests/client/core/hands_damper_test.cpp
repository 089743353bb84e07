// The damper that keeps several hands on one body calm, against its closed form.
#include "client/core/hands_damper.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "tests/support/circling_hand.hpp"
#include "tests/support/floor_patch.hpp"

using namespace palpate;
using test::kRadiusM;
using test::on_circle;
using test::pressed_floor;
using test::share_on_circle;

namespace {

/// Two tools on two modes, 7 and 3 of which they move along the normal.
Patch two_tools() {
  Patch p = pressed_floor(Eigen::RowVector2d(7, 3));
  p.stiffness << 5000, 9000;
  p.c_static = 2e-4 * Mat3::Identity();
  p.contact_stiffness_n_m = 800;
  p.others.count = 1;
  OtherContact& other = p.others.of[0];
  other.normal = Vec3::UnitZ();
  other.rows = PortRows::Zero(3, 2);
  other.rows.row(2) << 6, -1;
  other.c_static = 3e-4 * Mat3::Identity();
  return p;
}

}  // namespace

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
