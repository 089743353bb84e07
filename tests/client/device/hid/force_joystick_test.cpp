#include "client/device/hid/force_joystick.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "tests/client/device/hid/pid_stick.hpp"

using palpate::DeviceCaps;
using palpate::ForceJoystick;
using palpate::ForceJoystickOptions;
using palpate::HidCommand;
using palpate::HidInput;
using palpate::InputError;
using palpate::Micros;
using palpate::ReportDescriptor;
using palpate::Vec3;
using palpate::test::PidManner;
using palpate::test::PidStick;

namespace {

ForceJoystickOptions four_newtons() {
  ForceJoystickOptions options;
  options.force_max_n = 4;
  return options;
}

}  // namespace

TEST_CASE("Both manners of PID joysticks render a force vector within a step of their magnitude and direction", "[hid]") {
  for (const PidManner manner : {PidManner::arrays, PidManner::flags}) {
    PidStick stick(manner);
    CHECK(ForceJoystick::is(ReportDescriptor(stick.descriptor())));
    ForceJoystick joystick(four_newtons());
    joystick.begin(stick);
    CHECK(stick.resets == 1);
    CHECK(stick.enabled);
    CHECK(stick.gain == 255);
    REQUIRE(stick.effects.size() == 2);
    for (const auto& [index, effect] : stick.effects) {
      CHECK(effect.constant);
      CHECK(effect.gain == 255);
      CHECK(effect.duration_ms == 200);
      CHECK_FALSE(effect.playing);
    }
    int tick = 0;
    for (const Vec3& force : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-2, 3, 0), Vec3(0.001, -0.7, 2), Vec3(9, -9, 0)}) {
      REQUIRE(joystick.send(stick, {force, true, true}, Micros{++tick * 1000}));
      const auto felt = stick.force();
      for (int i = 0; i < 2; ++i)
        CHECK(4 * felt[static_cast<std::size_t>(i)] == Approx(std::clamp(force[i], -4., 4.)).margin(0.03));
    }
    joystick.send(stick, {Vec3(3, 3, 3), false, true}, Micros{++tick * 1000});
    CHECK(stick.force() == std::array<double, 2>{0, 0});
  }
}

TEST_CASE("A tick sends a joystick what changed, and starts its effects again before they end", "[hid]") {
  PidStick stick(PidManner::arrays);
  ForceJoystick joystick(four_newtons());
  joystick.begin(stick);
  joystick.send(stick, {Vec3(1, 1, 0), true, true}, Micros{0});
  const int before = stick.writes;
  joystick.send(stick, {Vec3(1, 1, 0), true, true}, Micros{1000});
  CHECK(stick.writes == before);
  joystick.send(stick, {Vec3(1, 2, 0), true, true}, Micros{2000});
  CHECK(stick.writes == before + 1);
  for (int ms = 3; ms <= 1000; ++ms) joystick.send(stick, {Vec3(1, 2, 0), true, true}, Micros{ms * 1000});
  for (const auto& [index, effect] : stick.effects) CHECK(effect.starts == 21);
}

TEST_CASE("A joystick's position is its share of the reach, away from the user where its y is towards the user", "[hid]") {
  PidStick stick(PidManner::flags);
  ForceJoystick joystick(four_newtons());
  const DeviceCaps caps = joystick.begin(stick);
  CHECK(caps.workspace.max().isApprox(Vec3(0.05, 0.05, 0)));
  CHECK(caps.force_max_n == 4);
  HidInput input = joystick.unheard();
  CHECK_FALSE(input.reading.ok());
  REQUIRE(joystick.take(palpate::test::bytes_of(PidStick::report(32767, -16383, 0x05)), input));
  CHECK(input.reading.ok());
  CHECK((input.reading.position - Vec3(0.05, 0.025, 0)).norm() < 1e-6);
  CHECK(input.reading.buttons == 5);
  CHECK_FALSE(joystick.take(palpate::test::bytes_of(std::vector<std::uint8_t>{2, 0, 0, 0, 0, 0}), input));
}

TEST_CASE("A turned force turns alone", "[hid]") {
  PidStick stick(PidManner::flags);
  ForceJoystickOptions options = four_newtons();
  options.flip_x = true;
  ForceJoystick joystick(options);
  joystick.begin(stick);
  joystick.send(stick, {Vec3(2, 2, 0), true, true}, Micros{0});
  CHECK(stick.force()[0] == Approx(-0.5).margin(1e-3));
  CHECK(stick.force()[1] == Approx(0.5).margin(1e-3));
}

TEST_CASE("A joystick that spreads what belongs together over reports is refused", "[hid]") {
  /// Moves the fields from this usage on to another report.
  struct SpreadStick final : PidStick {
    SpreadStick(std::uint8_t usage, std::uint8_t next) : PidStick(PidManner::arrays) {
      const auto whole = PidStick::descriptor();
      bytes.assign(whole.begin(), whole.end());
      const std::array<std::byte, 3> begin{std::byte{0x09}, std::byte{usage}, std::byte{next}};
      const auto at = std::search(bytes.begin(), bytes.end(), begin.begin(), begin.end());
      REQUIRE(at != bytes.end());
      bytes.insert(at, {std::byte{0x85}, std::byte{0x30}});
    }
    std::span<const std::byte> descriptor() const override { return bytes; }
    std::vector<std::byte> bytes;
  };
  struct Place {
    std::uint8_t usage, next;
  };
  for (const Place& place : {Place{0x70, 0x16}, Place{0x78, 0xA1}, Place{0x8B, 0xA1}, Place{0x25, 0xA1}, Place{0x50, 0x09}}) {
    SpreadStick stick(place.usage, place.next);
    ForceJoystick joystick(four_newtons());
    CHECK_THROWS_WITH(joystick.begin(stick), Catch::Contains("in a report of its own"));
  }
}

TEST_CASE("A joystick without a known force, without room or that never loads is refused in words", "[hid]") {
  CHECK_THROWS_WITH(ForceJoystick(ForceJoystickOptions{}), Catch::Contains("force in newtons is not known"));
  PidStick full(PidManner::arrays);
  full.room = 1;
  ForceJoystick joystick(four_newtons());
  CHECK_THROWS_WITH(joystick.begin(full), Catch::Contains("no room for another effect"));
  PidStick slow(PidManner::arrays);
  slow.loads_until_ready = 1000;
  CHECK_THROWS_WITH(joystick.begin(slow), Catch::Contains("did not load an effect in 60 tries"));
  PidStick gone(PidManner::arrays);
  gone.plugged = false;
  CHECK_THROWS_AS(joystick.begin(gone), InputError);
  palpate::test::FixedTransport mouse{palpate::test::one_report_descriptor()};
  CHECK_THROWS_AS(joystick.begin(mouse), InputError);
  CHECK_FALSE(ForceJoystick::is(ReportDescriptor(mouse.descriptor())));
}
