// The reference firmware core by itself.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/client/device/hid/bench_device.hpp"

using palpate::test::bench_limits;
using palpate::test::BenchDevice;

namespace {

using Force = std::array<std::int32_t, 3>;
constexpr std::uint8_t kArm = FORCE_HID_FLAG_ARM, kRamp = FORCE_HID_FLAG_RAMP, kClear = FORCE_HID_FLAG_CLEAR;

double norm(const Force& f) { return std::sqrt(std::pow(f[0], 2) + std::pow(f[1], 2) + std::pow(f[2], 2)); }

}  // namespace

TEST_CASE("A device renders the force that it is told, to the millinewton, once it was armed", "[hid]") {
  BenchDevice device;
  CHECK(device.step() == Force{});
  CHECK(device.core.state == FORCE_HID_STATE_READY);
  device.send(kArm, {100, 200, 300});
  CHECK(device.step() == Force{});  // armed without being disarmed first
  device.send(0);
  device.send(kArm, {100, -200, 300});
  CHECK(device.step() == Force{100, -200, 300});
  CHECK(device.core.state == FORCE_HID_STATE_ARMED);
  device.send(kArm, {-1, 1, 0});
  CHECK(device.step() == Force{-1, 1, 0});
  device.send(0, {500, 0, 0});
  CHECK(device.step() == Force{});
  CHECK(device.core.state == FORCE_HID_STATE_READY);
}

TEST_CASE("No force before the device is homed, and none when it loses its home", "[hid]") {
  BenchDevice device;
  device.sensors.homed = false;
  device.arm({100, 0, 0});
  CHECK(device.core.state == FORCE_HID_STATE_HOMING);
  CHECK(device.force_mn == Force{});
  device.sensors.homed = true;
  device.arm({100, 0, 0});
  CHECK(device.force_mn == Force{100, 0, 0});
  device.sensors.homed = false;
  CHECK(device.step() == Force{});
  CHECK(device.core.state == FORCE_HID_STATE_HOMING);
}

TEST_CASE("The watchdog takes the force away at its time, and a host that only goes on does not get it back", "[hid]") {
  BenchDevice device;
  device.arm({1000, 0, 0});
  device.send(kArm, {1000, 0, 0});
  for (int ms = 1; ms < 20; ++ms) CHECK(device.step() == Force{1000, 0, 0});
  CHECK(device.step() == Force{});
  CHECK(device.core.state == FORCE_HID_STATE_TIMED_OUT);
  for (int ms = 0; ms < 50; ++ms) {
    device.send(kArm, {1000, 0, 0});
    CHECK(device.step() == Force{});
  }
  device.send(0);
  device.send(kArm, {1000, 0, 0});
  CHECK(device.step() == Force{1000, 0, 0});
}

TEST_CASE("A report that was seen before, or is older, neither counts nor holds off the watchdog", "[hid]") {
  BenchDevice device;
  device.arm({1000, 0, 0});
  const std::uint16_t last = device.sequence;
  for (int ms = 1; ms < 20; ++ms) {
    CHECK_FALSE(device.send_as(last, kArm, {2000, 0, 0}));
    CHECK_FALSE(device.send_as(static_cast<std::uint16_t>(last - 1), kArm, {2000, 0, 0}));
    device.step();
  }
  CHECK(device.core.state == FORCE_HID_STATE_TIMED_OUT);
}

TEST_CASE("The sequence and the clock may wrap around", "[hid]") {
  BenchDevice device;
  device.sequence = 0xFFFE;
  device.now_us = 0xFFFFFFFF - 2500;
  device.arm({10, 0, 0});
  for (int ms = 0; ms < 100; ++ms) {
    CHECK(device.send(kArm, {20, 0, 0}));
    CHECK(device.step() == Force{20, 0, 0});
  }
}

TEST_CASE("Arming and disarming with the ramp flag take the ramp's time", "[hid]") {
  force_hid_limits limits = bench_limits();
  limits.ramp_ms = 50;
  BenchDevice device(limits);
  device.step();
  device.send(0);
  for (int ms = 1; ms <= 60; ++ms) {
    device.send(kArm | kRamp, {1000, 0, 0});
    CHECK(std::abs(device.step()[0] - 20 * std::min(ms, 50)) <= 1);
    CHECK(((device.core.status & FORCE_HID_STATUS_RAMPING) != 0) == (ms < 50));
  }
  for (int ms = 1; ms <= 60; ++ms) {
    device.send(kRamp, {1000, 0, 0});
    CHECK(std::abs(device.step()[0] - std::max(0, 1000 - 20 * ms)) <= 1);
  }
  CHECK(device.core.state == FORCE_HID_STATE_READY);
}

TEST_CASE("A force beyond the peak keeps its direction and loses its length", "[hid]") {
  BenchDevice device;
  device.arm();
  const auto largest = std::numeric_limits<std::int32_t>::max(), least = std::numeric_limits<std::int32_t>::min();
  for (const Force& asked : {Force{8501, 0, 0}, Force{6000, -6000, 6000}, Force{largest, largest, least}, Force{0, least, 0}}) {
    device.send(kArm, asked);
    const Force got = device.step();
    CHECK(norm(got) <= 8500);
    CHECK(norm(got) > 8497);
    for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(got[i] - 8500 * (asked[i] / norm(asked))) < 2);
    CHECK((device.core.status & FORCE_HID_STATUS_CLAMPED) != 0);
  }
  device.send(kArm, {8500, 0, 0});
  CHECK(device.step() == Force{8500, 0, 0});
  CHECK((device.core.status & FORCE_HID_STATUS_CLAMPED) == 0);
}

TEST_CASE("Peak force is there for as long as the motors are cool, the continuous force for ever", "[hid]") {
  BenchDevice device;
  device.arm();
  // From cold h = F^2 (1 - exp(-t / T)): the fall from the peak begins when h is 3/4 of the square of the continuous force.
  const double begins_s = -10 * std::log(1 - 0.75 * 1400. * 1400 / (8500. * 8500));
  int whole_ms = 0;
  for (int ms = 0; ms < 60'000; ++ms) {
    device.send(kArm, {8500, 0, 0});
    if (device.step()[0] == 8500) whole_ms = ms + 1;
  }
  CHECK(whole_ms == Approx(1000 * begins_s).margin(1.5));
  CHECK(device.force_mn[0] == Approx(1400).margin(3));
  CHECK((device.core.status & FORCE_HID_STATUS_WARM) != 0);
  for (int ms = 0; ms < 10'000; ++ms) {
    device.send(kArm, {1400, 0, 0});
    device.step();
  }
  CHECK(device.force_mn[0] == Approx(1400).margin(3));
  for (int ms = 0; ms < 30'000; ++ms) {
    device.send(kArm);
    device.step();
  }
  device.send(kArm, {8500, 0, 0});
  CHECK(device.step() == Force{8500, 0, 0});
}

TEST_CASE("A fault takes the force away at once and is left only by a host that clears it, once its cause is gone", "[hid]") {
  for (const std::uint16_t fault : {FORCE_HID_STATUS_TOO_HOT, FORCE_HID_STATUS_ENCODER, FORCE_HID_STATUS_SWITCH}) {
    BenchDevice device;
    device.arm({1000, 0, 0});
    device.sensors.faults = fault;
    CHECK(device.step() == Force{});
    device.send(kClear);
    device.step();
    CHECK(device.core.state == FORCE_HID_STATE_FAULT);
    device.sensors.faults = 0;
    device.step();
    device.send(0);
    device.send(kArm, {1000, 0, 0});
    CHECK(device.step() == Force{});
    CHECK(device.core.status == fault);
    device.send(kClear);
    device.send(kArm, {1000, 0, 0});
    CHECK(device.step() == Force{1000, 0, 0});
    CHECK(device.core.status == 0);
  }
}

TEST_CASE("A tool faster than the limit is a fault, one just below it is not", "[hid]") {
  BenchDevice device;
  device.arm({1000, 0, 0});
  for (const int nm : {1'999'000, -1'999'000}) {
    device.send(kArm, {1000, 0, 0});
    device.sensors.position_nm[1] += nm;
    CHECK(device.step() == Force{1000, 0, 0});
  }
  device.send(kArm, {1000, 0, 0});
  device.sensors.position_nm[0] += 1'500'000;
  device.sensors.position_nm[1] += 1'500'000;
  CHECK(device.step() == Force{});
  CHECK(device.core.status == FORCE_HID_STATUS_TOO_FAST);
}

TEST_CASE("Whatever bytes come in whatever order, the force is within the peak, and zero unless armed", "[hid]") {
  std::mt19937 random(4);
  BenchDevice device(palpate::test::turning_limits());
  std::uint64_t armed = 0;
  for (int n = 0; n < 200'000; ++n) {
    std::array<std::uint8_t, 36> report{};
    for (std::uint8_t& byte : report) byte = static_cast<std::uint8_t>(random());
    if (random() % 8 != 0) {
      report[0] = FORCE_HID_OUTPUT_ID;
      report[1] = static_cast<std::uint8_t>(++device.sequence);
      report[2] = static_cast<std::uint8_t>(device.sequence >> 8);
      if (random() % 4 != 0) report[3] = kArm;
    }
    force_hid_receive(&device.core, report.data(), random() % (report.size() + 1), device.now_us);
    device.sensors.homed = random() % 64 != 0;
    device.sensors.faults = random() % 64 == 0 ? static_cast<std::uint16_t>(random()) : std::uint16_t{0};
    if (random() % 32 == 0) device.sensors.position_nm[random() % 3] = static_cast<std::int32_t>(random());
    device.step(random() % 16 == 0 ? static_cast<std::uint32_t>(random()) : 1000);
    REQUIRE(norm(device.force_mn) <= 8500);
    REQUIRE(norm(device.torque_unm) <= 300'000);
    if (device.core.state != FORCE_HID_STATE_ARMED) REQUIRE(device.force_mn == Force{});
    if (device.core.state != FORCE_HID_STATE_ARMED) REQUIRE(device.torque_unm == Force{});
    armed += device.core.state == FORCE_HID_STATE_ARMED;
  }
  CHECK(armed > 1000);
}

TEST_CASE("The input report is the one of the profile's page, byte by byte", "[hid]") {
  BenchDevice device;
  device.sensors = {true, 0, {1, -1, 0x01020304}, {0, 0, -32767, 0x1234}, 0x0005, 0x0605};
  device.now_us = 0x0A0B0C0D - 1000;
  device.core.input_sequence = 0x0201;
  device.core.taken_sequence = 0x0403;
  device.step();
  std::array<std::uint8_t, FORCE_HID_INPUT_BYTES> report{};
  CHECK(force_hid_input_report(&device.core, report.data()) == report.size());
  const std::array<std::uint8_t, FORCE_HID_INPUT_BYTES> expected{
      1, 0x01, 0x02, 0x0D, 0x0C, 0x0B, 0x0A, 1,    0,    0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 4,    3,    2,
      1, 0,    0,    0,    0,    0x01, 0x80, 0x34, 0x12, 5, 0, 0,    0,    1,    0x03, 0x04, 0x05, 0x06};
  CHECK(report == expected);
  force_hid_input_report(&device.core, report.data());
  CHECK(report[1] == 2);
}

TEST_CASE("Limits out of range are brought into it", "[hid]") {
  force_hid_limits limits = bench_limits();
  limits.peak_mn = 4'000'000'000;
  limits.continuous_mn = 3'000'000'000;
  limits.watchdog_ms = 0;
  BenchDevice device(limits);
  CHECK(device.core.limits.peak_mn == 100'000);
  CHECK(device.core.limits.continuous_mn == 100'000);
  CHECK(device.core.limits.watchdog_ms == 1);
}

TEST_CASE("A torque is rendered to the micronewton metre by a device that has it, and by no other", "[hid]") {
  BenchDevice turns(palpate::test::turning_limits()), does_not;
  for (BenchDevice* device : {&turns, &does_not}) {
    device->arm({100, 0, 0}, {-12'345, 1, 299'999 / 2});
    CHECK(device->force_mn == Force{100, 0, 0});
  }
  CHECK(turns.torque_unm == Force{-12'345, 1, 299'999 / 2});
  CHECK(does_not.torque_unm == Force{});
  turns.sensors.faults = FORCE_HID_STATUS_ENCODER;
  turns.step();
  CHECK(turns.torque_unm == Force{});
}

TEST_CASE("Beyond the peak of either, force and torque lose length by one factor", "[hid]") {
  BenchDevice device(palpate::test::turning_limits());
  device.arm();
  const auto largest = std::numeric_limits<std::int32_t>::max(), least = std::numeric_limits<std::int32_t>::min();
  for (const auto& [force, torque] : {std::pair<Force, Force>{{4000, 0, 0}, {0, 600'000, 0}},
                                      {{0, -17'000, 0}, {100'000, 0, 100'000}},
                                      {{largest, largest, least}, {largest, largest, least}},
                                      {{0, 0, 0}, {0, least, 0}}}) {
    device.send(kArm, force, torque);
    device.step();
    const double share = std::min(norm(force) > 0 ? 8500 / norm(force) : 1, 300'000 / norm(torque));
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(std::abs(device.force_mn[i] - share * force[i]) <= 2);
      // The length of the force that decides is rounded to a whole number of up to 17,000.
      CHECK(std::abs(device.torque_unm[i] - share * torque[i]) <= 1 + std::abs(share * torque[i]) / 8500);
    }
    CHECK(norm(device.force_mn) <= 8500);
    CHECK(norm(device.torque_unm) <= 300'000);
    CHECK((device.core.status & FORCE_HID_STATUS_CLAMPED) != 0);
  }
}

TEST_CASE("Peak torque is there for as long as its motors are cool, whatever the force does", "[hid]") {
  BenchDevice device(palpate::test::turning_limits());
  device.arm();
  const double begins_s = -10 * std::log(1 - 0.75 * 50. * 50 / (300. * 300));
  int whole_ms = 0;
  for (int ms = 0; ms < 60'000; ++ms) {
    device.send(kArm, {100, 0, 0}, {0, 300'000, 0});
    device.step();
    if (device.torque_unm[1] == 300'000) whole_ms = ms + 1;
  }
  CHECK(whole_ms == Approx(1000 * begins_s).margin(1.5));
  CHECK(device.torque_unm[1] == Approx(50'000).margin(200));
  CHECK((device.core.status & FORCE_HID_STATUS_WARM) != 0);
}
