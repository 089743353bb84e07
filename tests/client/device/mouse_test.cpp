#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/mouse_device.hpp"
#include "common/base/limits.hpp"

using namespace palpate;

namespace {

constexpr Micros kTick{1'000'000 / kHapticRateHz};

/// A pointer at 60 Hz along a path, read at 1 kHz; records the tool's motion.
struct Ride {
  double velocity_jump_max = 0, speed_max = 0;
  Vec3 at = Vec3::Zero();
};

template <class Path>
Ride ride(const Path& path, Micros length) {
  MouseDevice mouse(Vec3::Zero());
  Ride ride;
  Vec3 before = Vec3::Zero(), velocity_before = Vec3::Zero();
  Micros next_picture{0};
  for (Micros t{0}; t < length; t += kTick) {
    if (t >= next_picture) {
      mouse.aim(path(seconds(t)));
      next_picture += Micros{16'667};
    }
    const DeviceReading reading = mouse.read(t);
    REQUIRE(reading.ok());
    const Vec3 velocity = (reading.position - before) * kHapticRateHz;
    ride.velocity_jump_max = std::max(ride.velocity_jump_max, (velocity - velocity_before).norm());
    ride.speed_max = std::max(ride.speed_max, velocity.norm());
    before = ride.at = reading.position;
    velocity_before = velocity;
  }
  return ride;
}

}  // namespace

TEST_CASE("the tool of a mouse follows a 60 Hz pointer without steps in place or speed") {
  // A sine of 50 mm at 1 Hz: its own acceleration is 2 m/s^2, its steps at 60 Hz are up to 5.2 mm.
  const auto sine = [](double t) { return Vec3(0.05 * std::sin(2 * M_PI * t), 0, 0); };
  const Ride r = ride(sine, Micros{2'000'000});
  CHECK(r.speed_max < 1.1 * 0.05 * 2 * M_PI);
  CHECK(r.velocity_jump_max < 0.03);  // m/s in a millisecond; a raw step would be 5
  CHECK((r.at - sine(2.0 - 2 / MouseDevice::kPace)).norm() < 0.05 * 2 * M_PI / 60);  // trails by 2 / w, and by up to a picture
}

TEST_CASE("a leap of the pointer is travelled at a bounded speed and without overshoot") {
  double beyond = 0;
  MouseDevice mouse(Vec3::Zero());
  mouse.aim(Vec3(0.3, 0, 0));
  Vec3 at = Vec3::Zero();
  for (Micros t{0}; t < Micros{1'000'000}; t += kTick) {
    const Vec3 next = mouse.read(t).position;
    CHECK((next - at).norm() * kHapticRateHz <= MouseDevice::kSpeedMaxMS);
    beyond = std::max(beyond, next.x() - 0.3);
    at = next;
  }
  CHECK(beyond <= 1e-12);
  CHECK(at.x() == Approx(0.3).margin(1e-6));
}

TEST_CASE("ticks that never ran do not change where the tool ends up") {
  MouseDevice every(Vec3::Zero()), some(Vec3::Zero());
  every.aim(Vec3(0.01, 0, 0));
  some.aim(Vec3(0.01, 0, 0));
  Vec3 a, b;
  for (int tick = 0; tick <= 60; ++tick) {
    a = every.read(tick * kTick).position;
    if (tick % 20 == 0) b = some.read(tick * kTick).position;
  }
  CHECK((a - b).norm() < 1e-12);
}

TEST_CASE("the window hears of place and force, and of no force once the mouse has stopped") {
  MouseDevice mouse(Vec3(1, 2, 3));
  CHECK(mouse.feel() == nullptr);
  mouse.read(Micros{0});
  mouse.write(Vec3(0, 0, 4));
  const MouseFeel* feel = mouse.feel();
  REQUIRE(feel != nullptr);
  CHECK(feel->position == Vec3(1, 2, 3));
  CHECK(feel->force == Vec3(0, 0, 4));
  mouse.stop();
  feel = mouse.feel();
  REQUIRE(feel != nullptr);
  CHECK(feel->force == Vec3::Zero());
}
