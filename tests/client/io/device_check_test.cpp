// The verdicts of --check-device, and its force test on a device whose hand yields one way or the other.
#include "client/io/device_check.hpp"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/support/felt_device.hpp"

using namespace palpate;

namespace {

/// A tool on a spring to its start: it moves along a force, or against it.
class Yielding final : public Device {
 public:
  explicit Yielding(double m_per_n) : m_per_n_(m_per_n) {
    caps_.force_max_n = 4;
    caps_.force_continuous_n = 1;
    caps_.slew_max_n_s = 1000;
    caps_.stiffness_max_n_m = 1000;
    caps_.velocity_max_m_s = 100;
    caps_.workspace = Eigen::AlignedBox3d(Vec3::Constant(-1), Vec3::Constant(1));
    caps_.buttons = 2;
  }
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros) noexcept override {
    DeviceReading reading;
    reading.state = DeviceState::ok;
    reading.position = m_per_n_ * force_;
    reading.buttons = 2;
    most_ = std::max(most_, force_.norm());
    return reading;
  }
  void write(const Wrench& wrench) noexcept override { force_ = wrench.force; }
  void stop() noexcept override { force_ = Vec3::Zero(); }
  double most() const { return most_; }

 private:
  DeviceCaps caps_ = test::felt_caps();
  double m_per_n_, most_ = 0;
  Vec3 force_ = Vec3::Zero();
};

DeviceFigures good_figures() {
  DeviceFigures figures;
  figures.ticks = 10'000;
  figures.state = DeviceState::ok;
  return figures;
}

DeviceCaps known_caps() {
  DeviceCaps caps;
  caps.force_max_n = 4;
  caps.slew_max_n_s = 1000;
  return caps;
}

}  // namespace

TEST_CASE("A device that yields along the push is right, against it is wrong, and one that does not move says nothing",
          "[realtime]") {
  const auto [m_per_n, expected] =
      GENERATE(table<double, Yield>({{0.01, Yield::along}, {-0.01, Yield::against}, {1e-4, Yield::not_at_all}}));
  const std::atomic<bool> stop{false};
  Yielding device(m_per_n);
  DeviceCheck check(device, false);
  CHECK(check.test_force_n() == 0.25);  // a quarter of what its motors can hold
  CHECK(check.push(1, stop) == expected);
  const DeviceFigures figures = check.finish();
  CHECK(device.most() == Approx(0.25));
  CHECK(figures.buttons == 2);
  CHECK(figures.state == DeviceState::ok);
}

TEST_CASE("What does not serve is named: no known force, late ticks, skipped ticks, a device that is not ok", "[realtime]") {
  CHECK(faults_of(good_figures(), known_caps()).empty());
  CHECK(faults_of(good_figures(), DeviceCaps{}).size() == 1);
  DeviceFigures late = good_figures();
  late.late_ticks = 200;
  late.skipped_ticks = 20;
  CHECK(faults_of(late, known_caps()).size() == 2);
  DeviceFigures gone = good_figures();
  gone.state = DeviceState::gone;
  gone.reason = "the connection to it broke";
  const auto faults = faults_of(gone, known_caps());
  REQUIRE(faults.size() == 1);
  CHECK(faults[0] == "the device was not ok at the end: the connection to it broke");
}

TEST_CASE("A device that does not get ready says each reason once and is given up", "[realtime]") {
  struct Waits final : Device {
    DeviceCaps none;
    int readings = 0;
    const DeviceCaps& caps() const override { return none; }
    DeviceReading read(Micros) noexcept override {
      return not_ok(DeviceState::not_ready, ++readings < 5 ? "it is not calibrated" : "hands off");
    }
    void write(const Wrench&) noexcept override {}
    void stop() noexcept override {}
  } device;
  std::vector<std::string> said;
  const std::atomic<bool> stop{false};
  Micros now{};
  CHECK_FALSE(wait_until_ready(
      device, Micros{50'000}, stop, [&](const DeviceReading& reading, Micros) { said.emplace_back(reading.reason.text()); },
      [&now] { return now += Micros{1'000}; }));
  CHECK(said == std::vector<std::string>{"it is not calibrated", "hands off"});
}

TEST_CASE("Of a device that stays silent is said every five seconds for how long it has been", "[realtime]") {
  struct Silent final : Device {
    DeviceCaps none;
    const DeviceCaps& caps() const override { return none; }
    DeviceReading read(Micros) noexcept override { return not_ok(DeviceState::not_ready, "it has sent nothing yet"); }
    void write(const Wrench&) noexcept override {}
    void stop() noexcept override {}
  } device;
  Micros now{};
  std::vector<Micros> said;
  const std::atomic<bool> stop{false};
  CHECK_FALSE(wait_until_ready(
      device, Micros{12'000'000}, stop, [&](const DeviceReading&, Micros waited) { said.push_back(waited); },
      [&now] { return now += Micros{100'000}; }));
  CHECK(said == std::vector<Micros>{Micros{100'000}, Micros{5'100'000}, Micros{10'100'000}});
}
