#include "client/device/replay_device.hpp"

#include <catch2/catch.hpp>

using palpate::Micros;
using palpate::Motion;
using palpate::ReplayDevice;
using palpate::Vec3;

namespace {
Motion line() { return Motion({{0.0, Vec3(0, 0, 1)}, {1.0, Vec3(1, 0, 1)}}); }
}  // namespace

TEST_CASE("A replayed motion starts with the first reading, wherever the clock stands", "[device]") {
  ReplayDevice device(line());
  const Micros epoch{987'654'321'000};
  CHECK(device.read(epoch).position == Vec3(0, 0, 1));
  CHECK(device.read(epoch + Micros{250'000}).position.isApprox(Vec3(0.25, 0, 1)));
}

TEST_CASE("A replayed motion ignores force and says when it has ended", "[device]") {
  ReplayDevice device(line());
  device.read(Micros{0});
  device.write(Vec3(5, 5, 5));
  CHECK(device.read(Micros{500'000}).position.isApprox(Vec3(0.5, 0, 1)));
  CHECK(device.read(Micros{1'000'000}).ok());
  const auto after = device.read(Micros{1'001'000});
  CHECK_FALSE(after.ok());
  CHECK(after.position == Vec3(1, 0, 1));
  CHECK(device.force() == Vec3(5, 5, 5));
  device.stop();
  CHECK(device.force() == Vec3::Zero());
}

TEST_CASE("A replayed motion that is to stay at its end does so, and stays a device", "[device]") {
  ReplayDevice device(line(), ReplayDevice::AtEnd::stays);
  device.read(Micros{0});
  const auto after = device.read(Micros{100'000'000});
  CHECK(after.ok());
  CHECK(after.position == Vec3(1, 0, 1));
}

TEST_CASE("A motion that waits stands at its beginning until its start", "[device]") {
  ReplayDevice device(line());
  device.wait_for_start();
  CHECK(device.read(Micros{10'000'000}).position == Vec3(0, 0, 1));
  CHECK(device.read(Micros{60'000'000}).ok());
  device.start(Micros{70'000'000});
  CHECK(device.read(Micros{69'000'000}).position == Vec3(0, 0, 1));
  CHECK(device.read(Micros{70'500'000}).position.isApprox(Vec3(0.5, 0, 1)));
}
