// Torque in the guard: limits, slew, heat and the account of energy of force and torque together.
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <limits>
#include <random>

#include "client/guard/guard.hpp"
#include "common/base/rotation_vector.hpp"
#include "tests/client/guard/felt.hpp"

using palpate::Guard;
using palpate::GuardLimits;
using palpate::MotorHeat;
using palpate::Passivity;
using palpate::PassivityMode;
using palpate::rotation_by;
using palpate::ToolPose;
using palpate::Vec3;
using palpate::Wrench;

namespace {

constexpr double kTorqueDt = 1e-3;

GuardLimits turning(PassivityMode passivity = PassivityMode::off) {
  GuardLimits limits;
  limits.passivity = passivity;
  limits.renders_torque = true;
  return limits;
}

ToolPose turned_about_z(double rad) { return {Vec3::Zero(), rotation_by(Vec3(0, 0, rad))}; }

}  // namespace

TEST_CASE("Beyond either limit force and torque are scaled by one factor, the largest that both allow", "[guard]") {
  GuardLimits limits = turning();
  limits.force_max_n = 8;
  limits.torque_max_nm = 0.3;
  for (const auto& [force_n, torque_nm] : {std::pair{16.0, 0.1}, {4.0, 0.9}, {16.0, 0.9}, {7.0, 0.2}}) {
    Guard guard(limits);
    const Wrench asked(force_n * Vec3(0.6, 0, -0.8), torque_nm * Vec3(0, 1, 0));
    const double share = std::min({1.0, 8 / force_n, 0.3 / torque_nm});
    const Wrench out = guard.pass(asked, Vec3(0, 0, 0), kTorqueDt);
    CHECK((out.force - share * asked.force).norm() < 1e-12);
    CHECK((out.torque - share * asked.torque).norm() < 1e-12);
    CHECK(guard.counts().clamped == (share < 1 ? 1 : 0));
  }
}

TEST_CASE("A tick changes force and torque in one proportion, by no more than the slew of each", "[guard]") {
  GuardLimits limits = turning();
  limits.slew_max_n_s = 1000;
  limits.torque_slew_max_nm_s = 50;
  Guard guard(limits);
  const Wrench asked(Vec3(2, 0, 0), Vec3(0, 0, 0.4));
  for (int k = 1; k <= 8; ++k) {  // 1 N a tick would be 0.2 N m: the torque decides, an eighth a tick
    const Wrench out = guard.pass(asked, Vec3(0, 0, 0), kTorqueDt);
    CHECK((out.force - k / 8.0 * asked.force).norm() < 1e-12);
    CHECK((out.torque - k / 8.0 * asked.torque).norm() < 1e-12);
  }
  CHECK(guard.counts().slew_limited >= 7);  // the eighth by rounding
}

TEST_CASE("Motors that turn the tool warm by the torque that they hold, and the force weakens with the torque", "[guard]") {
  GuardLimits limits = turning();
  limits.torque_max_nm = 0.3;
  limits.torque_continuous_nm = 0.05;
  Guard guard(limits);
  double heat = 0, whole_s = 0, torque = 0;
  for (int i = 0; i < 240'000; ++i) {
    const Wrench out = guard.pass({Vec3(3, 0, 0), Vec3(0, 1, 0)}, Vec3(0, 0, 0), kTorqueDt);
    torque = out.torque.y();
    REQUIRE(out.force.x() == Approx(3 * torque));
    REQUIRE(torque >= 0.05 - 1e-12);
    heat += kTorqueDt / MotorHeat::kTimeS * (torque * torque / (0.05 * 0.05) - heat);  // Euler, against the closed form
    REQUIRE(heat < 1 + 1e-3);
    if (torque > 0.3 - 1e-12) whole_s += kTorqueDt;
  }
  CHECK(torque == Approx(0.05).epsilon(1e-2));
  const double n = 36;  // (0.3 / 0.05)^2, until 0.8 of the rise
  CHECK(whole_s == Approx(MotorHeat::kTimeS * std::log(n / (n - (1 - MotorHeat::kBand)))).epsilon(2e-3));
}

TEST_CASE("A torque that is not a number leaves as zero, is counted, and the force stays", "[guard]") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    GuardLimits limits = turning(PassivityMode::on);
    limits.torque_max_nm = 0.3;
    Guard guard(limits);
    const Wrench out = guard.pass({Vec3(1, 0, 0), Vec3(0, bad, 0)}, Vec3(0, 0, 0), kTorqueDt);
    CHECK(out.force == Vec3(1, 0, 0));
    CHECK(out.torque == Vec3(0, 0, 0));
    CHECK(guard.counts().not_finite == 1);
    CHECK(guard.pass({Vec3(1, 0, 0), Vec3(0, 0.1, 0)}, Vec3(0, 0, 0), kTorqueDt).torque == Vec3(0, 0.1, 0));
    const ToolPose nowhere(Vec3(0, 0, 0), palpate::Rotation(bad, 0, 0, 0));
    CHECK(guard.pass({Vec3(1, 0, 0), Vec3(0, 0.1, 0)}, nowhere, kTorqueDt).finite());
  }
}

TEST_CASE("The force of a device without torque is the same to the bit, whatever torque and orientation there are", "[guard]") {
  GuardLimits limits{8.5, 2000, PassivityMode::on};
  limits.force_continuous_n = 1.4;
  limits.velocity_max_m_s = 1;
  Guard with(limits), without(limits);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> draw(-1, 1);
  Vec3 at = Vec3::Zero();
  for (int i = 0; i < 20'000; ++i) {
    at += 3e-4 * Vec3(draw(random), draw(random), draw(random));
    const Vec3 force = Vec3(3 * std::sin(0.01 * i), draw(random), -200 * at.z());
    const Vec3 torque(draw(random), i % 50 == 0 ? std::nan("") : 0.0, 1);
    const double dt_s = i % 997 == 0 ? 0.03 : kTorqueDt;
    const Wrench out = with.pass({force, torque}, ToolPose(at, rotation_by(Vec3(0.01 * i, 0, draw(random)))), dt_s);
    REQUIRE(out.force == palpate::test::felt(without, force, at, dt_s));
    REQUIRE(out.torque == Vec3(0, 0, 0));
  }
  CHECK(with.counts().damped > 100);
  CHECK(with.counts().damped == without.counts().damped);
  CHECK(with.counts().energy_min_j == without.counts().energy_min_j);
  CHECK(with.counts().torques_left_out == 20'000);
}

TEST_CASE("A torque that turns the tool along gives the energy T phi, one that is turned against takes it", "[guard]") {
  Guard gives(turning(PassivityMode::observe)), takes(turning(PassivityMode::observe));
  for (int i = 0; i <= 100; ++i) {
    gives.pass({Vec3(0, 0, 0), Vec3(0, 0, 0.2)}, turned_about_z(1e-3 * i), kTorqueDt);
    takes.pass({Vec3(0, 0, 0), Vec3(0, 0, -0.2)}, turned_about_z(1e-3 * i), kTorqueDt);
  }
  CHECK(gives.counts().energy_min_j == Approx(-0.2 * 0.1).epsilon(1e-9));
  CHECK(takes.counts().energy_min_j > -1e-12);
}

TEST_CASE("What a contact took as work of its force it may return as work of its torque: the account is one", "[guard]") {
  // A spring along z at the end of an arm: pressed by the position, released by the rotation, round and round.
  Guard guard(turning(PassivityMode::on));
  const Vec3 arm(0.05, 0, 0);
  double of_torque_j = 0;
  Wrench last;
  ToolPose before;
  for (int i = 0; i < 20'000; ++i) {
    const double phase = 2e-3 * i;
    const ToolPose tool(Vec3(0, 0, -0.004 * (1 - std::cos(phase))), rotation_by(Vec3(0, -0.08 * std::sin(phase), 0)));
    const Vec3 end = tool.turn * arm;
    const Vec3 force(0, 0, std::max(0.0, -600 * (tool.position + end).z()));
    const Wrench asked(force, end.cross(force));
    const Wrench out = guard.pass(asked, tool, kTorqueDt);
    REQUIRE(out.force == asked.force);
    REQUIRE(out.torque == asked.torque);
    const Vec3 turned = palpate::rotation_between(before.turn, tool.turn);
    of_torque_j += 0.5 * (last.torque + out.torque).dot(turned);
    last = out;
    before = tool;
  }
  CHECK(guard.counts().damped == 0);
  CHECK(std::abs(of_torque_j) > 10 * Passivity::kFullJ);  // by itself the torque is active, or a brake
}

TEST_CASE("About one axis a torque is limited as a force along a line is, at the lever L, so that what holds there holds here",
          "[guard]") {
  constexpr double kLever = Passivity::kLeverM;
  GuardLimits along{8.5, 2000, PassivityMode::on}, about = turning(PassivityMode::on);
  about.torque_max_nm = kLever * along.force_max_n;
  about.torque_slew_max_nm_s = kLever * along.slew_max_n_s;
  Guard linear(along), angular(about);
  std::deque<double> late(25, 0.0);  // a spring of 25 ms ago, which swings up the mass that it holds
  double x = 0.01, v = 0;
  for (int i = 0; i < 4000; ++i) {
    late.push_back(-150 * x);
    late.pop_front();
    const double force = palpate::test::felt(linear, Vec3(late.front(), 0, 0), Vec3(x, 0, 0), kTorqueDt).x();
    const ToolPose pose(Vec3(0, 0, 0), rotation_by(Vec3(x / kLever, 0, 0)));
    const double torque = angular.pass({Vec3(0, 0, 0), Vec3(kLever * late.front(), 0, 0)}, pose, kTorqueDt).torque.x();
    REQUIRE(torque == Approx(kLever * force).margin(1e-9));
    v += force / 0.3 * kTorqueDt;
    x += v * kTorqueDt;
  }
  CHECK(linear.counts().damped > 500);
  CHECK(angular.counts().damped == linear.counts().damped);
  CHECK(angular.counts().energy_min_j == Approx(linear.counts().energy_min_j));
  CHECK(angular.counts().damper_max_nm == Approx(kLever * linear.counts().damper_max_n));
}

TEST_CASE("A tool that turns faster than its device's limit has no wrench until it is slower", "[guard]") {
  GuardLimits limits = turning();
  limits.spin_max_rad_s = 20;
  Guard guard(limits);
  double angle = 0;
  const auto felt = [&](double rad_s) {
    return guard.pass({Vec3(1, 0, 0), Vec3(0, 0.1, 0)}, turned_about_z(angle += rad_s * kTorqueDt), kTorqueDt);
  };
  for (int i = 0; i < 50; ++i) CHECK(felt(19).torque.y() == 0.1);
  int ticks = 0;
  while (!felt(24).zero()) REQUIRE(++ticks < 40);
  CHECK(guard.counts().too_fast > 10);
  for (int i = 0; i < 100; ++i) felt(1);
  CHECK(felt(1).torque.y() == Approx(0.1));
}
