#include "client/device/sim_phantom.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"

using palpate::Hand;
using palpate::Micros;
using palpate::Motion;
using palpate::SimPhantom;
using palpate::SimPhantomOptions;
using palpate::Vec3;

namespace {

Motion still() { return Motion::rest(Vec3(0.1, 0.2, 0.3), 10); }

SimPhantomOptions exact(const Hand& hand) {
  SimPhantomOptions options;
  options.hand = hand;
  options.tremor_m = options.position_step_m = options.force_step_n = 0;
  return options;
}

/// Displacement in m x'' + b x' + k x = F from rest under a step of force; underdamped.
double step_response(double m, double b, double k, double force_n, double t) {
  const double a = b / (2 * m), w = std::sqrt(k / m - a * a);
  return force_n / k * (1 - std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t)));
}

}  // namespace

TEST_CASE("A held device answers a step of force as the damped oscillator that it is", "[device]") {
  for (const char* name : {"light", "reference", "firm"}) {
    const Hand hand = *palpate::hand_from_name(name);
    SimPhantom device(still(), exact(hand));
    device.read(Micros{0});
    device.write(Vec3(0.5, 0, -1));
    for (int ms = 1; ms <= 1000; ++ms) {
      const Vec3 moved = device.read(Micros{ms * 1000}).position - Vec3(0.1, 0.2, 0.3);
      const double expected = step_response(0.075 + hand.mass_kg, hand.damping_n_s_m, hand.stiffness_n_m, 1, ms * 1e-3);
      REQUIRE(std::abs(moved.x() - 0.5 * expected) < 1e-12);
      REQUIRE(std::abs(moved.y()) < 1e-15);
      REQUIRE(std::abs(moved.z() + expected) < 1e-12);
    }
  }
}

TEST_CASE("A device in nobody's hand is a free mass of 75 g", "[device]") {
  SimPhantom device(still(), exact(*palpate::hand_from_name("free")));
  device.read(Micros{0});
  device.write(Vec3(0, 0, 0.3));
  device.read(Micros{50'000});
  const Vec3 moved = device.read(Micros{100'000}).position - Vec3(0.1, 0.2, 0.3);
  CHECK(moved.z() == Approx(0.5 * 0.3 / 0.075 * 0.01).epsilon(1e-12));
}

TEST_CASE("A hand catches up with a steady motion", "[device]") {
  // w = u t: relative to w the equation is homogeneous, so the tool ends at the intention itself, without lag.
  const Motion ramp({{0.0, Vec3::Zero()}, {10.0, Vec3(0.5, 0, 0)}});
  SimPhantom device(ramp, exact(*palpate::hand_from_name("firm")));
  for (int ms = 0; ms <= 3000; ++ms) device.read(Micros{ms * 1000});
  CHECK(device.position().x() == Approx(0.15).epsilon(1e-6));
  CHECK(device.velocity().x() == Approx(0.05).epsilon(1e-5));
}

TEST_CASE("How often the device is read does not change where it goes", "[device]") {
  const Hand hand = *palpate::hand_from_name("reference");
  SimPhantom often(still(), exact(hand)), seldom(still(), exact(hand));
  for (auto* device : {&often, &seldom}) {
    device->read(Micros{0});
    device->write(Vec3(1, 0, 0));
  }
  for (int us = 0; us <= 90'000; us += 100) often.read(Micros{us});
  seldom.read(Micros{90'000});
  CHECK((often.position() - seldom.position()).norm() < 1e-13);
}

TEST_CASE("Position is read in steps from where the device was switched on, force is rendered in steps and clamped", "[device]") {
  SimPhantomOptions options;
  options.tremor_m = 0;
  SimPhantom device(Motion({{0.0, Vec3(0.04, 0.04, 0.1)}, {1.0, Vec3(0.05, 0.04, 0.1)}}), options);
  CHECK(device.read(Micros{0}).position == Vec3(0.04, 0.04, 0.1));
  for (int ms = 1; ms < 1000; ++ms) {
    const double read_steps = (device.read(Micros{ms * 1000}).position.x() - 0.04) / 3e-5;
    REQUIRE(std::abs(read_steps - std::round(read_steps)) < 1e-6);
    REQUIRE(std::abs(0.04 + 3e-5 * read_steps - device.position().x()) <= 1.5e-5 + 1e-12);
  }
  device.write(Vec3(0.036, -0.034, 0.5));
  CHECK(device.force().isApprox(Vec3(0.07, 0, 0.49)));
  device.write(Vec3(100, 0, 0));
  CHECK(device.force().x() == Approx(8.5).margin(0.035));
  device.write(Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 0));
  CHECK(device.force() == Vec3::Zero());
  device.write(Vec3(1, 0, 0));
  device.stop();
  CHECK(device.force() == Vec3::Zero());
}

TEST_CASE("Tremor has the power of a 0.1 mm sine, starts from rest, and repeats with its seed", "[device]") {
  const palpate::Tremor one(1e-4, 7), same(1e-4, 7), other(1e-4, 8);
  CHECK(one.offset(0).norm() == 0);
  CHECK(one.offset(0.001).norm() < 1e-8);
  CHECK(one.offset(3.3) == same.offset(3.3));
  CHECK(one.offset(3.3) != other.offset(3.3));
  double power = 0;
  const int n = 60'000;
  for (int i = 0; i < n; ++i) power += one.offset(1 + i * 1e-3).squaredNorm() / n;
  CHECK(std::sqrt(power) == Approx(1e-4 / std::sqrt(2)).epsilon(0.05));
}

TEST_CASE("Tremor lies between 8 and 12 Hz", "[device]") {
  const palpate::Tremor tremor(1e-4, 3);
  const int n = 20'000;  // 20 s: 0.05 Hz apart
  const auto power_at = [&](double hz) {
    double c = 0, s = 0;
    for (int i = 0; i < n; ++i) {
      const double x = tremor.offset(1 + i * 1e-3).x(), phase = 2 * M_PI * hz * i * 1e-3;
      const double window = 0.5 - 0.5 * std::cos(2 * M_PI * i / n);
      c += window * x * std::cos(phase);
      s += window * x * std::sin(phase);
    }
    return c * c + s * s;
  };
  double inside = 0, outside = 0;
  for (double hz = 1; hz < 30; hz += 0.25) (hz > 7.75 && hz < 12.25 ? inside : outside) += power_at(hz);
  CHECK(inside > 1000 * outside);
}

TEST_CASE("The same seed and calls give the same bits", "[device]") {
  SimPhantomOptions options;
  options.seed = 42;
  SimPhantom a(still(), options), b(still(), options);
  for (int ms = 0; ms < 2000; ++ms) {
    const Vec3 force(std::sin(ms * 0.01), 0, 0.5);
    const Vec3 at = a.read(Micros{ms * 1000}).position;
    REQUIRE(at == b.read(Micros{5'000'000 + ms * 1000}).position);
    a.write(force);
    b.write(force);
  }
}

TEST_CASE("A hand that lets go leaves the device to the force with the speed it had", "[device]") {
  SimPhantomOptions options = exact(*palpate::hand_from_name("reference"));
  options.release_s = 0.5;
  SimPhantom device(Motion({{0.0, Vec3::Zero()}, {10.0, Vec3(0.1, 0, 0)}}), options);
  for (int ms = 0; ms <= 500; ++ms) device.read(Micros{ms * 1000});
  const Vec3 at = device.position(), speed = device.velocity();
  device.write(Vec3(0, 0.15, 0));
  device.read(Micros{600'000});
  CHECK((device.position() - at).x() == Approx(speed.x() * 0.1).epsilon(1e-9));
  CHECK((device.position() - at).y() == Approx(0.5 * 2 * 0.01).epsilon(1e-9));
}

TEST_CASE("A grip that loosens goes on holding, as the tolerance_factor hand that it is", "[device]") {
  SimPhantomOptions options = exact(*palpate::hand_from_name("firm"));
  options.release_s = 0.5;
  options.hand_after_release = *palpate::hand_from_name("light");
  SimPhantom device(still(), options);
  for (int ms = 0; ms <= 500; ++ms) device.read(Micros{ms * 1000});
  device.write(Vec3(0.5, 0, 0));
  device.read(Micros{580'000});
  device.read(Micros{660'000});
  CHECK(device.position().x() - 0.1 == Approx(step_response(0.175, 2, 100, 0.5, 0.160)).epsilon(1e-9));
}

TEST_CASE("A free device with friction of its own slows down exponentially, wherever the hand goes", "[device]") {
  SimPhantomOptions options = exact(*palpate::hand_from_name("free"));
  options.device_damping_n_s_m = 0.3;
  SimPhantom device(Motion({{0.0, Vec3::Zero()}, {10.0, Vec3(1, 0, 0)}}), options);
  device.read(Micros{0});
  device.write(Vec3(0, 0, 0.6));
  for (int ms = 1; ms <= 500; ++ms) device.read(Micros{ms * 1000});
  // m v' = F - b v from rest: v = F/b (1 - e^(-t/T)), x = F/b (t - T (1 - e^(-t/T))), T = m/b
  const double lag = 0.075 / 0.3, part = 1 - std::exp(-0.5 / lag);
  CHECK(device.velocity().z() == Approx(2 * part).epsilon(1e-12));
  CHECK(device.position().z() == Approx(2 * (0.5 - lag * part)).epsilon(1e-12));
  CHECK(std::abs(device.position().x()) < 1e-15);
}

TEST_CASE("A clock that goes back or leaps is survived", "[device]") {
  SimPhantom device(still(), exact(*palpate::hand_from_name("reference")));
  device.read(Micros{1'000'000});
  device.write(Vec3(1, 0, 0));
  const Vec3 before = device.read(Micros{1'010'000}).position;
  CHECK(device.read(Micros{1'005'000}).position == before);
  const Vec3 after = device.read(Micros{3'600'000'000}).position;  // the hand stood still for all but 0.1 s of the hour
  const double expected = step_response(0.575, 6, 135, 1, 0.110);
  CHECK(after.x() - 0.1 == Approx(expected).epsilon(1e-9));
  CHECK(device.read(Micros{3'600'001'000}).position.x() - 0.1 == Approx(step_response(0.575, 6, 135, 1, 0.111)).epsilon(1e-9));
}

TEST_CASE("Options out of range and unknown hands are refused", "[device]") {
  CHECK_FALSE(palpate::hand_from_name("iron"));
  const auto refused = [](auto change) {
    SimPhantomOptions options;
    change(options);
    CHECK_THROWS_AS(SimPhantom(still(), options), palpate::InputError);
  };
  refused([](auto& o) { o.device_mass_kg = 0; });
  refused([](auto& o) { o.device_damping_n_s_m = -1; });
  refused([](auto& o) { o.hand.stiffness_n_m = -1; });
  refused([](auto& o) { o.hand.damping_n_s_m = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& o) { o.tremor_m = std::numeric_limits<double>::infinity(); });
  refused([](auto& o) { o.release_s = -1; });
}

TEST_CASE("A device that turns answers a step of torque about any axis as the damped oscillator that it is", "[device]") {
  SimPhantomOptions options = exact(*palpate::hand_from_name("firm"));
  options.wrist = palpate::SimWrist{.torque_step_nm = 0};
  const palpate::SimWrist& wrist = *options.wrist;
  const Vec3 axis = Vec3(1, -2, 0.5).normalized();
  SimPhantom device(still(), options);
  CHECK(device.caps().renders_torque);
  CHECK(device.caps().has_orientation);
  device.read(Micros{0});
  device.write({Vec3(0, 0, 0), 0.1 * axis});
  for (int ms = 1; ms <= 1000; ++ms) {
    const Eigen::Quaterniond turn = device.read(Micros{ms * 1000}).orientation;
    const double expected = step_response(wrist.device_inertia_kg_m2 + wrist.inertia_kg_m2, wrist.damping_nm_s_rad,
                                          wrist.stiffness_nm_rad, 0.1, ms * 1e-3);
    REQUIRE((palpate::rotation_vector(palpate::Rotation(turn)) - expected * axis).norm() < 1e-12);
  }
}

TEST_CASE("Released, it turns freely, and its torque is rendered in steps, within its limit and in proportion to its force",
          "[device]") {
  SimPhantomOptions options = exact(*palpate::hand_from_name("firm"));
  options.wrist = palpate::SimWrist{};
  options.release_s = 0;
  SimPhantom device(still(), options);
  device.read(Micros{0});
  device.write({Vec3(0, 0, 0), Vec3(0, 0, 0.01)});
  device.read(Micros{50'000});
  device.read(Micros{100'000});
  CHECK(device.spin().z() == Approx(0.01 / 1e-4 * 0.1).epsilon(1e-9));
  device.write({Vec3(0, 0, 0), Vec3(0, 0.0123, 0)});
  CHECK(device.torque().isApprox(Vec3(0, 0.012, 0)));
  device.write({Vec3(4, 0, 0), Vec3(0, 0.6, 0)});
  CHECK(device.torque().isApprox(Vec3(0, 0.3, 0)));
  CHECK(device.force().x() == Approx(2));
  device.write({Vec3(1, 0, 0), Vec3(0, std::nan(""), 0)});
  CHECK(device.torque() == Vec3::Zero());
  CHECK(device.force().x() == Approx(1));
  SimPhantom plain(still(), exact(*palpate::hand_from_name("firm")));
  plain.write({Vec3(1, 0, 0), Vec3(0, 0.1, 0)});
  CHECK(plain.torque() == Vec3::Zero());
}
