#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/make_device.hpp"

using namespace palpate;

namespace {

/// Position of the tool half a second into a motion of 0.1 m/s against a force of 2 N.
double place_after_half_a_second(const DeviceOptions& options) {
  const Motion motion({{0, Vec3::Zero()}, {1, Vec3(0.1, 0, 0)}});
  const auto device = make_device(motion, options);
  device->start(Micros{0});
  double x = 0;
  for (Micros t{0}; t <= Micros{500'000}; t += Micros{1'000}) {
    x = device->read(t).position.x();
    device->write(Vec3(-2, 0, 0));
  }
  device->stop();
  return x;
}

}  // namespace

TEST_CASE("A device waits at the beginning of its motion until it is started", "[device]") {
  const Motion motion({{0, Vec3(0.01, 0, 0)}, {1, Vec3(0.1, 0, 0)}});
  const auto device = make_device(motion, {.kind = DeviceKind::replay});
  CHECK(device->read(Micros{0}).position == Vec3(0.01, 0, 0));
  CHECK(device->read(Micros{300'000}).position == Vec3(0.01, 0, 0));
}

TEST_CASE("Force moves the tool of a simulated device and not that of a replayed one", "[device]") {
  CHECK(place_after_half_a_second({.kind = DeviceKind::replay}) == Approx(0.05));
  // 2 N against a spring of 500 N/m hold the tool 4 mm behind the hand's intention; it still oscillates a little.
  DeviceOptions firm;
  firm.hand = *hand_from_name("firm");
  CHECK(place_after_half_a_second(firm) == Approx(0.046).margin(0.003));
}

TEST_CASE("Where a motion says how the tool is held and what is pressed, sim and replay report it at its time", "[device]") {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX()));
  const Motion held({{0, Vec3::Zero()}, {1, Vec3::Zero()}, {2, Vec3::Zero()}},
                    {{Eigen::Quaterniond::Identity(), quarter, quarter}, {0, 5, 0}, {}});
  for (const DeviceKind kind : {DeviceKind::sim, DeviceKind::replay}) {
    const auto device = palpate::make_device(held, {.kind = kind});
    CHECK(device->caps().has_orientation);
    CHECK(device->caps().buttons == 3);
    device->start(Micros{7'000'000});
    const auto at = [&](std::int64_t us) {
      palpate::DeviceReading reading;
      for (std::int64_t t = 7'000'000; t <= 7'000'000 + us; t += 50'000) reading = device->read(Micros{t});
      return reading;
    };
    CHECK(at(500'000).orientation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX()))) < 1e-9);
    CHECK(at(950'000).buttons == 0);
    CHECK(at(1'000'000).buttons == 5);
    CHECK(at(2'000'000).orientation.angularDistance(quarter) < 1e-9);
  }
  const auto plain = palpate::make_device(Motion::rest(Vec3::Zero(), 1));
  CHECK_FALSE(plain->caps().has_orientation);
  CHECK(plain->caps().buttons == 0);
}
