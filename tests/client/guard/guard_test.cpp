#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/client/guard/felt.hpp"

using palpate::Guard;
using palpate::GuardLimits;
using palpate::MotorHeat;
using palpate::Passivity;
using palpate::PassivityMode;
using palpate::Vec3;
using palpate::test::felt;

namespace {

constexpr double kDt = 1e-3;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("Without limits the guard passes every finite force as it is", "[guard]") {
  Guard guard;
  CHECK(felt(guard, Vec3(1, -2, 3), Vec3::Zero(), kDt) == Vec3(1, -2, 3));
  CHECK(felt(guard, Vec3(-900, 0, 0), Vec3::Ones(), kDt) == Vec3(-900, 0, 0));
  CHECK(guard.counts().clamped + guard.counts().slew_limited + guard.counts().not_finite == 0);
}

TEST_CASE("A force that is not finite leaves as zero and is not remembered", "[guard]") {
  for (const double bad : {kNan, kInf, -kInf}) {
    Guard guard({8.5, 1000, PassivityMode::on});
    felt(guard, Vec3(0.5, 0, 0), Vec3(0.01, 0, 0), kDt);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 force(0.5, 0.5, 0.5);
      force[axis] = bad;
      CHECK(felt(guard, force, Vec3(0.01, 0, 0), kDt).allFinite());
    }
    CHECK(guard.counts().not_finite == 3);
    const Vec3 after = felt(guard, Vec3(0.3, 0, 0), Vec3(0.01, 0, 0), kDt);
    CHECK(after == Vec3(0.3, 0, 0));
    CHECK(std::isfinite(guard.counts().energy_min_j));
  }
}

TEST_CASE("A huge change between finite forces cannot make something that is not finite", "[guard]") {
  Guard guard({0, 1000, PassivityMode::off});
  for (int i = 0; i < 10; ++i) {
    CHECK(felt(guard, Vec3(1.7e308, 0, 0), Vec3::Zero(), kDt).allFinite());
    CHECK(felt(guard, Vec3(-1.7e308, 0, 0), Vec3::Zero(), kDt).allFinite());
  }
}

TEST_CASE("The clamp bounds the norm and keeps the direction", "[guard]") {
  Guard guard({8.5, 0, PassivityMode::off});
  const Vec3 out = felt(guard, Vec3(30, -40, 0), Vec3::Zero(), kDt);
  CHECK(out.norm() == Approx(8.5).epsilon(1e-12));
  CHECK(out.normalized().isApprox(Vec3(0.6, -0.8, 0)));
  CHECK(guard.counts().clamped == 1);
}

TEST_CASE("The slew limit bounds the change between ticks, from the first one on, and a late tick gets no more than one",
          "[guard]") {
  Guard guard({0, 500, PassivityMode::off});
  CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), kDt).isApprox(Vec3(0.5, 0, 0)));
  CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), 15 * kDt).isApprox(Vec3(1, 0, 0)));
  CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), 0.5 * kDt).isApprox(Vec3(1.25, 0, 0)));
  CHECK(felt(guard, Vec3(1.2, 0, 0), Vec3::Zero(), kDt) == Vec3(1.2, 0, 0));
  CHECK(guard.counts().slew_limited == 3);
}

TEST_CASE("After a gap between two ticks the force begins at zero and is whole after the ramp, whatever it was before",
          "[guard]") {
  Guard guard({8.5, 0, PassivityMode::on});
  for (int i = 0; i < 10; ++i) felt(guard, Vec3(5, 0, 0), Vec3::Zero(), kDt);
  CHECK(felt(guard, Vec3(-7, 0, 0), Vec3(0.03, 0, 0), 0.021).norm() == 0);
  Vec3 before = Vec3::Zero();
  for (int i = 1; i <= Guard::kRampTicks; ++i) {
    const Vec3 out = felt(guard, Vec3(-7, 0, 0), Vec3(0.03, 0, 0), kDt);
    CHECK(out.isApprox(Vec3(-7.0 * i / Guard::kRampTicks, 0, 0)));
    CHECK((out - before).norm() <= 7.0 / Guard::kRampTicks + 1e-12);
    before = out;
  }
  CHECK(felt(guard, Vec3(-7, 0, 0), Vec3(0.03, 0, 0), 0.02) == Vec3(-7, 0, 0));  // no gap yet
  CHECK(guard.counts().restarts == 1);
}

TEST_CASE("A tool that is faster than its device is let go within 20 ms and taken again by the ramp", "[guard]") {
  GuardLimits limits{8.5, 0, PassivityMode::off};
  limits.velocity_max_m_s = 1;
  Guard guard(limits);
  double x = 0;
  const auto moved = [&](double speed) { return felt(guard, Vec3(4, 0, 0), Vec3(x += speed * kDt, 0, 0), kDt).x(); };
  for (int i = 0; i < 200; ++i) CHECK(moved(0.95) == 4);
  int ticks = 0;
  while (moved(1.2) > 0) REQUIRE(++ticks < 40);
  CHECK(ticks <= static_cast<int>(Guard::kSpeedTicks) + Guard::kStopTicks);
  for (int i = 0; i < 10; ++i) CHECK(moved(1.2) == 0);
  double before = 0;
  for (int i = 0; i < 100; ++i) {
    const double force = moved(0.1);
    CHECK(force - before <= 4.0 / Guard::kRampTicks + 1e-12);
    before = force;
  }
  CHECK(before == 4);
  CHECK(guard.counts().too_fast > 10);
}

TEST_CASE("Motors that are warm are asked for less and less, down to what they hold for ever, without an edge", "[guard]") {
  GuardLimits limits{8.5, 0, PassivityMode::off};
  limits.force_continuous_n = 1.4;
  Guard guard(limits);
  double heat = 0, before = 8.5, whole_s = 0;
  for (int i = 0; i < 240'000; ++i) {
    const double force = felt(guard, Vec3(0, 0, 20), Vec3::Zero(), kDt).z();
    REQUIRE(force <= before + 1e-9);
    REQUIRE(before - force < 0.05);
    REQUIRE(force >= 1.4 - 1e-9);
    heat += kDt / MotorHeat::kTimeS * (force * force / (1.4 * 1.4) - heat);  // Euler, against the closed form
    REQUIRE(heat < 1 + 1e-3);
    if (force == 8.5) whole_s += kDt;
    before = force;
  }
  CHECK(before == Approx(1.4).epsilon(1e-2));
  // Until 0.8 of the rise: T ln(n / (n - 0.8)) with n = (8.5 / 1.4)^2.
  const double n = 8.5 * 8.5 / (1.4 * 1.4);
  CHECK(whole_s == Approx(MotorHeat::kTimeS * std::log(n / (n - (1 - MotorHeat::kBand)))).epsilon(2e-3));
  CHECK(guard.counts().heat_limited > 200'000);
  for (int i = 0; i < 240'000; ++i) felt(guard, Vec3::Zero(), Vec3::Zero(), kDt);
  CHECK(felt(guard, Vec3(0, 0, 8), Vec3::Zero(), kDt).z() == 8);  // cold again
}

TEST_CASE("What motors hold for ever is never limited by their heat", "[guard]") {
  for (const double continuous : {1.4, 0.0, 12.0}) {
    GuardLimits limits{8.5, 0, PassivityMode::off};
    limits.force_continuous_n = continuous;
    Guard guard(limits);
    const double force = continuous == 1.4 ? 1.25 : 8.5;  // at 1.25 N they reach 0.797 of the rise
    for (int i = 0; i < 400'000; ++i) REQUIRE(felt(guard, Vec3(force, 0, 0), Vec3::Zero(), kDt).x() == force);
  }
}

TEST_CASE("The clamp comes before the slew limit: a clamped force is reached, not passed", "[guard]") {
  Guard guard({2, 500, PassivityMode::off});
  Vec3 out = Vec3::Zero();
  for (int i = 0; i < 10; ++i) out = felt(guard, Vec3(100, 0, 0), Vec3::Zero(), kDt);
  CHECK(out.isApprox(Vec3(2, 0, 0)));
  CHECK(guard.counts().clamped == 10);
  CHECK(guard.counts().slew_limited == 3);  // 0.5, 1.0, 1.5 N
}

TEST_CASE("The limiter's damper cannot lead past clamp and slew limit", "[guard]") {
  Guard guard({4, 400, PassivityMode::on});
  Vec3 before = Vec3::Zero();
  for (int i = 0; i < 3000; ++i) {
    const double x = 0.02 * std::sin(i * 0.05);
    const Vec3 out = felt(guard, Vec3(500 * 0.02 * std::cos(i * 0.05), 0, 0), Vec3(x, 0, 0), kDt);  // pushes along the motion
    REQUIRE(out.norm() <= 4 + 1e-12);
    REQUIRE((out - before).norm() <= 0.4 + 1e-12);
    before = out;
  }
  CHECK(guard.counts().damped > 0);
}

TEST_CASE("A tick without a length changes nothing", "[guard]") {
  Guard guard({0, 500, PassivityMode::on});
  const Vec3 before = felt(guard, Vec3(0.2, 0, 0), Vec3::Zero(), kDt);
  for (const double dt : {0.0, -1e-3, kNan, kInf}) CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), dt) == before);
}

TEST_CASE("After a restart the guard begins at zero force", "[guard]") {
  Guard guard({0, 500, PassivityMode::on});
  for (int i = 0; i < 10; ++i) felt(guard, Vec3(3, 0, 0), Vec3(i * 1e-3, 0, 0), kDt);
  guard.restart();
  CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), kDt).norm() == 0);
  CHECK(felt(guard, Vec3(3, 0, 0), Vec3::Zero(), kDt).isApprox(Vec3(3.0 / Guard::kRampTicks, 0, 0)));
}

namespace {

/// A hand of 0.5 kg on its own spring that was 20 mm inside a body of 500 N/m when the display returned.
struct CutOff {
  double x = -0.02, v = 0, given_j = 0, force_n = 0;

  /// One tick; force_n and given_j refer to the display.
  void tick(Guard& guard) {
    const double before_x = x, before_n = force_n;
    force_n = felt(guard, Vec3(std::max(0.0, -500 * x), 0, 0), Vec3(x, 0, 0), kDt).x();
    const double a = (force_n - 300 * (x + 0.02) - 6 * v) / 0.5;
    x += v * kDt + 0.5 * a * kDt * kDt;
    v += a * kDt;
    given_j += 0.5 * (before_n + force_n) * (x - before_x);
  }
};

}  // namespace

TEST_CASE("A force that comes back to a hand inside a body does not throw it, and is whole once the hand has given way") {
  Guard observe({8.5, 2000, PassivityMode::observe}), on({8.5, 2000, PassivityMode::on});
  CutOff thrown, held;
  double most_j = 0;
  for (int i = 1; i <= 400; ++i) {
    thrown.tick(observe);
    most_j = std::max(most_j, thrown.given_j);
  }
  REQUIRE(most_j > 0.03);
  for (int i = 1; i <= 20'000; ++i) {
    held.tick(on);
    const double one_tick_j = 8.5 * std::abs(held.v) * kDt;
    REQUIRE(held.given_j <= Passivity::kMostJ + Passivity::kReturnW * i * kDt + one_tick_j);
  }
  CHECK(held.x == Approx(-0.02 * 300 / 800).epsilon(1e-3));  // 300 (x + 0.02) = -500 x
  CHECK(held.force_n == Approx(-500 * held.x).epsilon(1e-3));
}

TEST_CASE("What a hand went into a body in a tick that was skipped did not cost it anything") {
  Guard guard({8.5, 0, PassivityMode::observe});
  for (int i = 0; i < 5; ++i) felt(guard, Vec3::Zero(), Vec3::Zero(), kDt);
  felt(guard, Vec3(3, 0, 0), Vec3(-0.03, 0, 0), 0.019);
  felt(guard, Vec3(3, 0, 0), Vec3(-0.0295, 0, 0), kDt);
  CHECK(guard.counts().energy_min_j == Approx(-3 * 0.0005));  // no stored energy that could be returned
}

TEST_CASE("Once a hand has felt its force for a second, what others do to it through the body is not taken for a return") {
  Guard guard({8.5, 0, PassivityMode::on});
  for (int i = 0; i <= 1000; ++i) felt(guard, Vec3(1, 0, 0), Vec3::Zero(), kDt);
  Vec3 out;
  for (int i = 0; i < 4000; ++i) out = felt(guard, Vec3(1, 0, 0), Vec3(i * 5e-6, 0, 0), kDt);  // 20 mJ at 5 mm/s
  CHECK(out.x() == Approx(1 - Passivity::kDeviceKg / ((Passivity::kWindow + 1) * kDt) * 0.005));
}

TEST_CASE("A partner may lead the hand for as long as it likes: that work is not in the account of the display") {
  const bool guided = GENERATE(true, false);
  Guard guard({8.5, 2000, PassivityMode::on});
  const Vec3 force(1, 0, 0);
  Vec3 at = Vec3::Zero(), shown = Vec3::Zero();
  for (int n = 0; n < 2000; ++n) {
    at.x() += 1e-4;  // 0.2 J in all
    shown = guided ? felt(guard, Vec3::Zero(), at, 1e-3, force) : felt(guard, force, at, 1e-3);
  }
  if (guided) {
    CHECK(shown == force);
    CHECK(guard.counts().damped == 0);
    CHECK(guard.counts().energy_min_j == 0);
  } else {
    CHECK(shown.x() < 0.3);
    CHECK(guard.counts().damped > 1000);
  }
}

TEST_CASE("Beside a partner's force a display that turned active is damped as without it, and their sum keeps the limits") {
  Guard with({8.5, 0, PassivityMode::on}), without({8.5, 0, PassivityMode::on}), limited({2, 100, PassivityMode::on});
  const Vec3 guidance(0, 0.5, 0);
  Vec3 at = Vec3::Zero(), before = Vec3::Zero();
  for (int n = 0; n < 1000; ++n) {
    at.x() += 1e-4;
    const Vec3 shown = felt(with, Vec3(1, 0, 0), at, 1e-3, guidance);
    REQUIRE((felt(without, Vec3(1, 0, 0), at, 1e-3) + guidance - shown).norm() < 1e-9);
    const Vec3 least = felt(limited, Vec3(1, 0, 0), at, 1e-3, Vec3(0, n % 100 < 50 ? 30.0 : -30.0, 0));
    REQUIRE(least.norm() <= 2 + 1e-9);
    REQUIRE((least - before).norm() <= 0.1 + 1e-9);
    before = least;
  }
  CHECK(with.counts().damped > 100);
  CHECK(felt(with, Vec3::Zero(), at, 1e-3, Vec3::Constant(kNan)).allFinite());
  CHECK(with.counts().not_finite == 1);
}
