#include "client/device/hid/space_mouse.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "common/base/error.hpp"
#include "tests/client/device/hid/space_mouse_bytes.hpp"

using palpate::AxisMap;
using palpate::DeviceReading;
using palpate::DeviceState;
using palpate::HidInput;
using palpate::InputError;
using palpate::Mat3;
using palpate::Micros;
using palpate::ReportDescriptor;
using palpate::SpaceMouse;
using palpate::SpaceMouseOptions;
using palpate::Vec3;
using palpate::test::FixedTransport;

namespace {

using Axes = std::array<std::int16_t, 6>;

struct Cap {
  SpaceMouse mouse;
  FixedTransport transport;
  HidInput input;
  Micros now{};

  Cap(const std::vector<std::uint8_t>& descriptor, const SpaceMouseOptions& options) : mouse(options), transport{descriptor} {
    mouse.begin(transport);
    input = mouse.unheard();
  }
  bool take(const std::vector<std::uint8_t>& report) { return mouse.take(palpate::test::bytes_of(report), input); }
  DeviceReading after(int ms) {
    DeviceReading reading = mouse.read(input, now);
    for (int i = 0; i < ms; ++i) reading = mouse.read(input, now += Micros{1000});
    return reading;
  }
};

}  // namespace

TEST_CASE("Both layouts of a six-axis mouse give the same deflection", "[hid]") {
  const Axes raw{350, -175, 35, -350, 70, 0};
  Cap two(palpate::test::two_report_descriptor(), {}), one(palpate::test::one_report_descriptor(), {});
  CHECK(two.take(palpate::test::three_axes(1, raw[0], raw[1], raw[2])));
  CHECK(two.input.deflection == std::array<double, 6>{1, -0.5, 0.1, 0, 0, 0});
  CHECK(two.take(palpate::test::three_axes(2, raw[3], raw[4], raw[5])));
  CHECK(one.take(palpate::test::six_axes(raw)));
  CHECK(one.input.deflection == std::array<double, 6>{1, -0.5, 0.1, -1, 0.2, 0});
  CHECK(one.input.deflection == two.input.deflection);
}

TEST_CASE("Deflections beyond the declared range are full, reports of other ids change nothing", "[hid]") {
  Cap cap(palpate::test::one_report_descriptor(), {});
  CHECK(cap.take(palpate::test::six_axes({400, -32768, 0, 0, 0, 0})));
  CHECK(cap.input.deflection[0] == 1);
  CHECK(cap.input.deflection[1] == -1);
  const auto before = cap.input.deflection;
  CHECK_FALSE(cap.take({0x17, 80, 0}));  // battery
  CHECK_FALSE(cap.take({1, 5}));         // cut off
  CHECK_FALSE(cap.take({}));
  CHECK(cap.input.deflection == before);
}

TEST_CASE("Buttons are a bitmap, and stay while axes move", "[hid]") {
  Cap cap(palpate::test::two_report_descriptor(), {});
  CHECK(cap.take({3, 0x02}));
  cap.take(palpate::test::three_axes(1, 10, 0, 0));
  CHECK(cap.after(1).buttons == 2);
  CHECK(cap.take({3, 0x01}));
  CHECK(cap.after(1).buttons == 1);
}

TEST_CASE("Pushing the cap right, away and up moves the tool along +x, +y and +z", "[hid]") {
  for (const auto control : {SpaceMouseOptions::Control::rate, SpaceMouseOptions::Control::position}) {
    SpaceMouseOptions options;
    options.control = control;
    // Raw: x right, y towards the user, z down.
    for (int axis = 0; axis < 3; ++axis) {
      Cap cap(palpate::test::one_report_descriptor(), options);
      Axes raw{};
      raw[static_cast<std::size_t>(axis)] = axis == 0 ? 350 : -350;
      cap.take(palpate::test::six_axes(raw));
      const Vec3 moved = cap.after(300).position;
      CHECK(moved[axis] > 0.03);
      CHECK(moved.norm() == Approx(moved[axis]));
    }
  }
}

TEST_CASE("Rate: the tool's speed is the shaped deflection, silence keeps it, a cap let go leaves the tool where it is",
          "[hid]") {
  SpaceMouseOptions options;
  Cap cap(palpate::test::one_report_descriptor(), options);
  cap.take(palpate::test::six_axes({175, 0, 0, 0, 0, 0}));
  const double share = (0.5 - SpaceMouse::kDeadZone) / (1 - SpaceMouse::kDeadZone);
  CHECK(cap.after(500).position.x() == Approx(0.15 * share * share * 0.5));
  CHECK(cap.after(500).position.x() == Approx(0.15 * share * share * 1.0));
  cap.take(palpate::test::six_axes({0, 0, 0, 0, 0, 0}));
  const Vec3 there = cap.after(1).position;
  CHECK(cap.after(1000).position == there);
  cap.take(palpate::test::six_axes({13, 0, 0, 0, 0, 0}));  // 13/350 is within the dead zone
  CHECK(cap.after(1000).position == there);
}

TEST_CASE("The tool stays in its workspace and comes back from its wall at once", "[hid]") {
  Cap cap(palpate::test::one_report_descriptor(), {});
  cap.take(palpate::test::six_axes({350, 0, 0, 0, 0, 0}));
  CHECK(cap.after(5000).position.x() == 0.15);
  cap.take(palpate::test::six_axes({-350, 0, 0, 0, 0, 0}));
  CHECK(cap.after(100).position.x() == Approx(0.15 - 0.015));
}

TEST_CASE("Position: the tool goes to the place of the deflection, never beyond it, and back when the cap is let go", "[hid]") {
  SpaceMouseOptions options;
  options.control = SpaceMouseOptions::Control::position;
  options.start = Vec3(0.01, 0, 0);
  Cap cap(palpate::test::one_report_descriptor(), options);
  CHECK(cap.after(1).position == options.start);
  cap.take(palpate::test::six_axes({-350, 0, 0, 0, 0, 0}));
  double before = 0.01;
  for (int ms = 0; ms < 1000; ++ms) {
    const double x = cap.after(1).position.x();
    CHECK(x <= before);
    CHECK(x >= 0.01 - 0.06);
    before = x;
  }
  CHECK(before == Approx(-0.05).epsilon(1e-9));
  cap.take(palpate::test::six_axes({0, 0, 0, 0, 0, 0}));
  CHECK((cap.after(1000).position - options.start).norm() < 1e-9);
}

TEST_CASE("A twist at full deflection turns the tool at the stated speed, about the axis that the hand turns", "[hid]") {
  Cap cap(palpate::test::one_report_descriptor(), {});
  cap.take(palpate::test::six_axes({0, 0, 0, 0, 0, -350}));  // raw z is down: counter-clockwise seen from above
  const Eigen::Quaterniond turned = cap.after(500).orientation;
  CHECK(turned.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vec3::UnitZ()))) < 1e-9);
}

TEST_CASE("A tool whose device is gone stays where it was", "[hid]") {
  Cap cap(palpate::test::one_report_descriptor(), {});
  cap.take(palpate::test::six_axes({350, 0, 0, 0, 0, 0}));
  const Vec3 there = cap.after(100).position;
  cap.input.reading.state = DeviceState::gone;
  CHECK(cap.after(1000).position == there);
}

TEST_CASE("Axes are written as signed letters, and mirrors are refused", "[hid]") {
  Mat3 expected;
  expected << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  CHECK(AxisMap::from_text("y z x").matrix == expected);
  CHECK(AxisMap::from_text("+x-y-z").matrix == Mat3(Vec3(1, -1, -1).asDiagonal()));
  for (const char* wrong : {"", "x y", "x y z x", "x x z", "x y -z", "a b c", "xyzw"})
    CHECK_THROWS_AS(AxisMap::from_text(wrong), InputError);
}

TEST_CASE("Names go with ids, and devices without six axes have none", "[hid]") {
  CHECK(palpate::space_mouse_model(0x046D, 0xC626) == "SpaceNavigator");
  CHECK(palpate::space_mouse_model(0x256F, 0xC635) == "SpaceMouse Compact");
  CHECK(palpate::space_mouse_model(0x256F, 0xC650).empty());
  CHECK(palpate::space_mouse_model(0x046D, 0xC635).empty());
}

TEST_CASE("A device without six axes is no six-axis mouse", "[hid]") {
  std::vector<std::uint8_t> bytes = palpate::test::one_report_descriptor();
  CHECK(SpaceMouse::is(ReportDescriptor(palpate::test::bytes_of(bytes))));
  bytes[3] = 0x04;  // a joystick
  const FixedTransport transport{bytes};
  CHECK_FALSE(SpaceMouse::is(ReportDescriptor(transport.descriptor())));
  FixedTransport open{bytes};
  SpaceMouse mouse(SpaceMouseOptions{});
  CHECK_THROWS_AS(mouse.begin(open), InputError);
}
