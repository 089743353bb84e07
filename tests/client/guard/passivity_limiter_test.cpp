// The passivity limiter of the guard: the observed energy, the dissipated energy, and no other effect.
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <limits>

#include "tests/client/guard/felt.hpp"

using palpate::Guard;
using palpate::Passivity;
using palpate::PassivityMode;
using palpate::Vec3;
using palpate::test::felt;

namespace {

constexpr double kStepS = 1e-3;

/// A mass against a spring of the display whose force is `delay` ticks old; returns the largest excursion of the last 200 ticks.
double bounce(Guard& guard, double stiffness_n_m, int delay, double mass_kg = 0.3, int ticks = 2000) {
  std::deque<double> late(static_cast<std::size_t>(delay) + 1, 0.0);
  double x = 0, v = 0.05, largest = 0;
  for (int i = 0; i < ticks; ++i) {
    late.push_back(-stiffness_n_m * x);
    late.pop_front();
    const Vec3 force = felt(guard, Vec3(late.front(), 0, 0), Vec3(x, 0, 0), kStepS);
    const double a = force.x() / mass_kg;
    x += v * kStepS + 0.5 * a * kStepS * kStepS;  // exact for a held force
    v += a * kStepS;
    if (i >= ticks - 200) largest = std::max(largest, std::abs(x));
  }
  return largest;
}

}  // namespace

TEST_CASE("Positions that are not finite and huge forces leave no trace in the limiter", "[guard]") {
  Guard guard({8.5, 0, PassivityMode::on});
  felt(guard, Vec3(1, 0, 0), Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0), kStepS);
  felt(guard, Vec3(1e308, 1e308, -1e308), Vec3(1e308, 0, 0), kStepS);
  felt(guard, Vec3(-1e308, 1e308, -1e308), Vec3(-1e308, 0, 0), kStepS);
  for (int i = 0; i < 100; ++i) felt(guard, Vec3::Zero(), Vec3::Zero(), kStepS);  // rest: the account starts again
  CHECK(felt(guard, Vec3(1, 2, 0), Vec3::Zero(), kStepS) == Vec3(1, 2, 0));
  CHECK(std::isfinite(guard.counts().energy_min_j));
}

TEST_CASE("A spring without delay counts as lossless and is not touched", "[guard]") {
  Guard guard({0, 0, PassivityMode::on});
  double x = 0;
  for (int i = 0; i < 20000; ++i) {
    x = 0.01 * std::sin(i * 0.021) + 0.004 * std::sin(i * 0.0517);
    const Vec3 force(-800 * x, 0, 0);
    REQUIRE(felt(guard, force, Vec3(x, 0, 0), kStepS) == force);
  }
  CHECK(guard.counts().damped == 0);
  CHECK(guard.counts().energy_min_j > -1e-9);
}

TEST_CASE("A damped spring is passive whatever the hand does", "[guard]") {
  Guard guard({0, 0, PassivityMode::on});
  Vec3 before = Vec3::Zero();
  for (int i = 1; i < 5000; ++i) {
    const Vec3 x(0.01 * std::sin(i * 0.03), 0.006 * std::cos(i * 0.011) - 0.006, 0.003 * std::sin(i * 0.07));
    const Vec3 force = -300 * x - 2 * (x - before) / kStepS;
    REQUIRE(felt(guard, force, x, kStepS) == force);
    before = x;
  }
}

TEST_CASE("The observed energy of a force along a known path is the work done", "[guard]") {
  Guard guard({0, 0, PassivityMode::observe});
  for (int i = 0; i <= 10; ++i) felt(guard, Vec3(0.5, 0, 0), Vec3(i * 1e-3, 0, 0), kStepS);
  // The display pushed the hand over 10 mm with 0.5 N, half of that in the first tick, which begins without force.
  CHECK(guard.counts().energy_min_j == Approx(-0.5 * 0.01).epsilon(1e-9));
  CHECK(guard.counts().damped == 0);
}

TEST_CASE("An active spring with delay grows by itself, and is calmed by the limiter", "[guard]") {
  Guard off({0, 0, PassivityMode::off}), observe({0, 0, PassivityMode::observe}), on({0, 0, PassivityMode::on});
  const double grown = bounce(off, 300, 20), watched = bounce(observe, 300, 20), calmed = bounce(on, 300, 20);
  CHECK(grown > 1);
  CHECK(watched == grown);
  CHECK(observe.counts().energy_min_j < -1e-3);
  CHECK(calmed < 0.01);
  CHECK(on.counts().damped > 0);
}

TEST_CASE("The limiter calms an active spring on a device that nobody holds and that reads in steps") {
  const auto amplitude = [](PassivityMode mode) {
    Guard guard({8.5, 2000, mode});
    std::deque<double> late(11, 0.0);
    double x = 0, v = 0.1, largest = 0;
    for (int i = 0; i < 4000; ++i) {
      const double read = std::round(x / 3e-5) * 3e-5;
      late.push_back(-300 * read);
      late.pop_front();
      // The observer leaves k T / 2 = 0.15 N s/m to the device's friction.
      const double a = (felt(guard, Vec3(late.front(), 0, 0), Vec3(read, 0, 0), kStepS).x() - 0.3 * v) / 0.075;
      x += v * kStepS + 0.5 * a * kStepS * kStepS;
      v += a * kStepS;
      if (i >= 3000) largest = std::max(largest, std::abs(x));
    }
    return largest;
  };
  CHECK(amplitude(PassivityMode::off) > 0.02);
  CHECK(amplitude(PassivityMode::on) < 0.002);
}

TEST_CASE("A step of the device's reading moves the force by no more than a hand does not notice, whatever the deficit") {
  Guard guard({8.5, 2000, PassivityMode::on});
  double x = 0;
  for (int i = 0; i < 100; ++i) felt(guard, Vec3(2, 0, 0), Vec3(x += 1e-4, 0, 0), kStepS);  // the display gives 20 mJ
  REQUIRE(guard.counts().energy_min_j < -Passivity::kFullJ);
  for (int i = 0; i < 20; ++i) felt(guard, Vec3(2, 0, 0), Vec3(x, 0, 0), kStepS);
  Vec3 before = felt(guard, Vec3(2, 0, 0), Vec3(x, 0, 0), kStepS);
  for (int i = 0; i < 400; ++i) {
    if (i % 9 == 0) x += i % 2 ? 3e-5 : -3e-5;
    const Vec3 out = felt(guard, Vec3(2, 0, 0), Vec3(x, 0, 0), kStepS);
    CHECK((out - before).norm() < 0.05);
    before = out;
  }
}

TEST_CASE("The limiter adds nothing where there is no force, and never more than there is") {
  Guard guard({8.5, 0, PassivityMode::on});
  double x = 0;
  for (int i = 0; i < 100; ++i) felt(guard, Vec3(2, 0, 0), Vec3(x += 1e-3, 0, 0), kStepS);
  for (const double force_n : {0.0, 0.01, -0.3, 1.0}) {
    const Vec3 out = felt(guard, Vec3(force_n, 0, 0), Vec3(x += 1e-3, 0, 0), kStepS);
    CHECK(std::abs(out.x() - force_n) <= std::abs(force_n) + 1e-15);
    CHECK(out.y() == 0);
  }
  felt(guard, Vec3(1, 0, 0), Vec3(x, 1e-3, 0), kStepS);
  CHECK(felt(guard, Vec3(1, 0, 0), Vec3(x, 2e-3, 0), kStepS).y() == 0);  // no drag across the force
}

TEST_CASE("A force beyond what the device shows is weighed as it is shown") {
  Guard guard({8.5, 0, PassivityMode::on});
  Vec3 out;
  for (int i = 0; i < 200; ++i) out = felt(guard, Vec3(100, 0, 0), Vec3(i * 1e-3, 0, 0), kStepS);  // along at 1 m/s
  CHECK(out.norm() < 0.1);
  CHECK(guard.counts().energy_min_j > -0.02);
  CHECK(guard.counts().clamped == 200);
}

TEST_CASE("While no force is asked for the energy account starts again", "[guard]") {
  Guard guard({0, 0, PassivityMode::on});
  for (int i = 0; i < 20; ++i) felt(guard, Vec3(1, 0, 0), Vec3(i * 1e-4, 0, 0), kStepS);
  REQUIRE(guard.counts().damped > 0);
  for (int i = 0; i < 60; ++i) felt(guard, Vec3::Zero(), Vec3::Zero(), kStepS);
  CHECK(felt(guard, Vec3(0.1, 0, 0), Vec3(-1e-4, 0, 0), kStepS) == Vec3(0.1, 0, 0));
}

TEST_CASE("What the limiter did to the force is counted: ticks, largest, root mean square, energy taken out") {
  Guard guard({0, 0, PassivityMode::on});
  double taken = 0, largest = 0, squares = 0;
  int ticks = 0;
  Vec3 added = Vec3::Zero();
  for (int i = 0; i <= 200; ++i) {
    taken -= added.x() * 1e-4;  // the tool moves by 0.1 mm under the force added before
    added = felt(guard, Vec3(0.5, 0, 0), Vec3(i * 1e-4, 0, 0), kStepS) - Vec3(0.5, 0, 0);
    if (added.norm() == 0) continue;
    ++ticks;
    largest = std::max(largest, added.norm());
    squares += added.squaredNorm();
  }
  REQUIRE(ticks > 100);
  CHECK(guard.counts().damped == static_cast<std::uint64_t>(ticks));
  CHECK(guard.counts().damper_max_n == Approx(largest));
  CHECK(guard.counts().damper_rms_n() == Approx(std::sqrt(squares / ticks)));
  CHECK(guard.counts().dissipated_j == Approx(taken - 0).epsilon(1e-9));
  // All energy that the display would have given, except the deficit needed to stop it.
  CHECK(guard.counts().dissipated_j == Approx(0.5 * 0.02 - Passivity::kFullJ).epsilon(0.02));
  guard.restart();
  CHECK(guard.counts().dissipated_j > 0);
}

namespace {

/// A free device of 75 g with some friction, on linearisations of age `age` ticks of a stiffening spring, -k (1 + 4 |x|^2 / (20
/// mm)^2) x, renewed every 17 ticks, displayed weaker where stiffer than 800 N/m.
class FreedOnOldPatches {
 public:
  FreedOnOldPatches(double stiffness_n_m, int age, const Vec3& velocity)
      : stiffness_n_m_(stiffness_n_m), velocity_(velocity), past_(static_cast<std::size_t>(age) + 1, position_) {}
  void tick(Guard& guard) {
    const Vec3 reading = (position_ / kStepM).array().round() * kStepM;
    past_.push_back(reading);
    past_.pop_front();
    if (ticks_++ % 17 == 0) about_ = past_.front();
    const Vec3 force = felt(guard, linearised(reading), reading, kStepS);
    given_j += 0.5 * (force_ + force).dot(reading - reading_);
    force_ = force;
    reading_ = reading;
    const Vec3 a = (force - 0.5 * velocity_) / 0.075;
    position_ += velocity_ * kStepS + 0.5 * a * kStepS * kStepS;
    velocity_ += a * kStepS;
  }
  double given_j = 0;

 private:
  static constexpr double kStepM = 3e-5, kStiffens = 4 / (0.02 * 0.02);
  Vec3 linearised(const Vec3& x) const {
    const double radial = kStiffens * about_.squaredNorm(), stiffest = stiffness_n_m_ * (1 + 3 * radial);
    const Vec3 step = x - about_;
    const Vec3 force = -stiffness_n_m_ * ((1 + radial) * x + 2 * kStiffens * about_ * about_.dot(step));
    return std::min(1.0, 800 / stiffest) * force;
  }
  double stiffness_n_m_;
  Vec3 position_{-0.005, -0.02, 0}, velocity_, about_ = position_;
  Vec3 force_ = Vec3::Zero(), reading_ = position_;
  std::deque<Vec3> past_;
  int ticks_ = 0;
};

}  // namespace

TEST_CASE("A device that nobody holds gets no more than the allowance from patches of up to a second ago") {
  for (const int age : {5, 50, 150, 421, 700, 1000})
    for (const double stiffness_n_m : {30.0, 100.0, 300.0})
      for (const Vec3& velocity : {Vec3(0.1, 0.05, 0), Vec3(-0.02, 0.2, 0.01), Vec3(0.25, -0.1, 0)}) {
        INFO(age << " ms, " << stiffness_n_m << " N/m, " << velocity.transpose() << " m/s");
        Guard on({.force_max_n = 8.5, .slew_max_n_s = 2000, .passivity = PassivityMode::on});
        FreedOnOldPatches freed(stiffness_n_m, age, velocity);
        double most_j = 0;
        for (int i = 0; i < 6000; ++i) {
          freed.tick(on);
          most_j = std::max(most_j, freed.given_j - Passivity::kReturnW * i * kStepS);
        }
        CHECK(most_j < Passivity::kMostJ + 1e-3);  // 1 mJ: energy of a tick or two before detection
      }
}

TEST_CASE(
    "A tool that orbits, its force nearly across its way, is stopped from getting more, and one that slides is not dragged") {
  for (const double push_m_s : {0.05, 0.0}) {  // speed along the force, part of 0.5 m/s
    Guard guard({.force_max_n = 8.5, .passivity = PassivityMode::on});
    for (int i = 0; i <= 20; ++i) felt(guard, Vec3(2, 0, 0), Vec3(i * 1e-4, 0, 0), kStepS);  // a deficit to begin with
    const double lowest_j = guard.counts().energy_min_j;
    REQUIRE(lowest_j < -Passivity::kFullJ);
    Vec3 out, force;
    Vec3 x(2e-3, 0, 0);
    for (int i = 0; i < 1000; ++i) {
      const double angle = i * 0.01, along = std::asin(push_m_s / 0.5);
      x += 0.5 * kStepS * Vec3(std::cos(angle), std::sin(angle), 0);
      force = 2 * Vec3(-std::sin(angle - along), std::cos(angle - along), 0);
      out = felt(guard, force, x, kStepS);
    }
    if (push_m_s > 0)
      CHECK(guard.counts().energy_min_j > lowest_j - 1e-3);  // the force alone would give 100 mJ
    else
      CHECK((out - force).norm() < 0.1);
  }
}

TEST_CASE("A limiter that has to hold a moving tool back does not shake it on a machine that is busy") {
  const auto largest_step_n = [](double speed_m_s, double early_or_late_s, int every_late) {
    Guard guard({.force_max_n = 8.5, .slew_max_n_s = 2000, .passivity = PassivityMode::on});
    Vec3 before = Vec3::Zero();
    double most_n = 0, t_s = 0;
    for (int i = 0; i < 400; ++i) {
      const double dt_s = i % every_late == every_late - 1 ? 4 * kStepS : kStepS;
      t_s += dt_s;
      const double x = speed_m_s * (t_s + early_or_late_s * std::sin(2.6 * i * i));  // irregular
      const Vec3 reading = (Vec3(x, 0.2 * x, 0) / 3e-5).array().round() * 3e-5;
      const Vec3 out = felt(guard, Vec3(1.3, 0, 0), reading, dt_s);
      if (i > 200) most_n = std::max(most_n, (out - before).norm());
      before = out;
    }
    CHECK(guard.counts().energy_min_j < -0.5 * Passivity::kFullJ);  // a deficit is required
    return most_n;
  };
  for (const double speed_m_s : {0.03, 0.05, 0.075, 0.1, 0.15, 0.2}) {
    INFO(speed_m_s << " m/s");
    CHECK(largest_step_n(speed_m_s, 0, 1000) < 0.1);     // a reading in steps of 0.03 mm
    CHECK(largest_step_n(speed_m_s, 3e-4, 1000) < 0.2);  // and early or late by up to 0.3 ms
    CHECK(largest_step_n(speed_m_s, 0, 40) < 0.2);       // and late by three ticks at times
  }
}
