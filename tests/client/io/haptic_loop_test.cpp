// The loop itself, in real time. Only what must hold on any machine, however late, is asserted.
#include "client/io/haptic_loop.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "common/io/monotonic.hpp"
#include "tests/support/felt_device.hpp"
#include "tests/support/patches.hpp"
#include "tests/support/realtime_guard.hpp"

using palpate::HapticLoop;
using palpate::HapticTick;
using palpate::kTick;
using palpate::Micros;
using palpate::PatchPlayer;
using palpate::Vec3;

namespace {

/// Watches its own thread, that of the loop, from one reading to the next.
class Watcher final : public palpate::Device {
 public:
  static constexpr int kFirst = 20, kLast = 150;
  const palpate::DeviceCaps& caps() const override { return caps_; }
  palpate::DeviceReading read(Micros) noexcept override {
    ++readings_;
    if (readings_ == kFirst) guard_.emplace();
    if (readings_ == kLast) seen = guard_->end();
    return {Vec3(0, 0, -0.005), readings_ <= kLast ? palpate::DeviceState::ok : palpate::DeviceState::ended};
  }
  void write(const palpate::Wrench&) noexcept override {}
  void stop() noexcept override {}
  void halt() noexcept override {}

  std::optional<palpate::test::RealtimeFaults> seen;

 private:
  int readings_ = 0;
  std::optional<palpate::test::RealtimeGuard> guard_;
  palpate::DeviceCaps caps_ = palpate::test::felt_caps();
};

/// Records its calls; ends after `readings_max` readings.
class Witness final : public palpate::Device {
 public:
  explicit Witness(std::size_t readings_max) : readings_max_(readings_max) {
    read_at.reserve(100'000);
    written.reserve(100'000);
  }
  const palpate::DeviceCaps& caps() const override { return caps_; }
  palpate::DeviceReading read(Micros now) noexcept override {
    read_at.push_back(now);
    palpate::DeviceReading reading;
    reading.position = Vec3(0, 0, -0.005);
    reading.state = read_at.size() <= readings_max_ ? palpate::DeviceState::ok : palpate::DeviceState::ended;
    reading.share = share;
    return reading;
  }
  void write(const palpate::Wrench& wrench) noexcept override { written.push_back(wrench.force); }
  void stop() noexcept override { ++stops; }
  void halt() noexcept override {}

  double share = 1;  ///< share of the force that the hand feels
  std::vector<Micros> read_at;
  std::vector<Vec3> written;
  int stops = 0;

 private:
  std::size_t readings_max_;
  palpate::DeviceCaps caps_ = palpate::test::felt_caps();
};

struct Display {
  explicit Display(Micros stamp = palpate::monotonic_now()) {
    auto patch = palpate::test::attach_patch(8, 1, stamp);
    patch.force = Vec3(0, 0, 2);
    slot->back() = PatchPlayer(patch);
    slot->publish();
  }
  std::unique_ptr<palpate::LatestSlot<PatchPlayer>> slot = std::make_unique<palpate::LatestSlot<PatchPlayer>>();
  std::unique_ptr<palpate::SampleRing> samples = std::make_unique<palpate::SampleRing>();
  HapticTick haptic{*slot, *samples, {}};
};

constexpr std::size_t kForever = 1'000'000;

}  // namespace

TEST_CASE("The loop ticks on a grid of milliseconds, forward, and accounts for every tick it skipped", "[realtime]") {
  Witness device(kForever);
  Display display, shadow;
  HapticLoop loop(device, {&display.haptic, &shadow.haptic}, {false, 1000});
  loop.start();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  CHECK(loop.running());
  CHECK(loop.displays_with_patch() == 2);
  loop.stop();
  CHECK_FALSE(loop.running());

  const auto& stats = loop.stats();
  REQUIRE(stats.ticks > 10);
  CHECK(stats.ticks + HapticLoop::kRampTicks == device.read_at.size());
  Micros covered{};
  for (std::size_t i = 1; i < stats.ticks; ++i) {
    const Micros step = device.read_at[i] - device.read_at[i - 1];
    REQUIRE(step >= kTick);
    REQUIRE(step.count() % kTick.count() == 0);
    covered += step;
  }
  const auto grid = static_cast<std::uint64_t>(covered / kTick) + 1;
  CHECK(stats.ticks + stats.skipped >= grid);
  CHECK(stats.tick_ns.count() == stats.ticks);
  CHECK(stats.work_ns.count() == stats.ticks);
  CHECK(stats.late >= stats.very_late);
  CHECK(display.haptic.counts().ticks == stats.ticks);
  CHECK(shadow.haptic.counts().ticks == stats.ticks);
}

TEST_CASE("Every way out ramps the force to zero and stops the device once", "[realtime]") {
  Witness device(kForever);
  Display display;
  {
    HapticLoop loop(device, {&display.haptic}, {false, 0});
    loop.start();
    for (int ms = 0; ms < 150 || (loop.at_zero() && ms < 20'000); ++ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    loop.stop();
    loop.stop();
  }
  CHECK(device.stops == 1);
  REQUIRE(device.written.size() > HapticLoop::kRampTicks + 1);
  CHECK(device.written.back().norm() == 0);
  const std::size_t last = device.written.size() - HapticLoop::kRampTicks - 1;
  REQUIRE(device.written[last].norm() > 0.1);
  for (std::size_t i = last + 1; i < device.written.size(); ++i) {
    const Vec3 expected = device.written[last] * (1 - static_cast<double>(i - last) / HapticLoop::kRampTicks);
    CHECK((device.written[i] - expected).norm() < 1e-12);
  }
}

TEST_CASE("A motion that has ended ends the loop, and its device is stopped without being written to", "[realtime]") {
  Witness device(20);
  Display display;
  HapticLoop loop(device, {&display.haptic}, {false, 0});
  loop.start();
  while (loop.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CHECK(device.stops == 1);
  CHECK(device.written.size() == 20);
  loop.stop();
  CHECK(loop.stats().device_ended);
  CHECK(device.stops == 1);
}

TEST_CASE("The loop's own thread allocates, locks and throws nothing", "[realtime]") {
  Watcher device;
  Display display, shadow;
  HapticLoop loop(device, {&display.haptic, &shadow.haptic}, {false, 1000});
  loop.start();
  while (loop.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  loop.stop();
  REQUIRE(device.seen);
  CHECK(device.seen->none());
}

TEST_CASE("A loop that was never started stops harmlessly", "[realtime]") {
  Witness device(kForever);
  Display display;
  HapticLoop loop(device, {&display.haptic}, {false, 0});
  loop.stop();
  CHECK(device.written.empty());
}

TEST_CASE("Every tick can be read while the loop runs, main display and comparisons side by side", "[realtime]") {
  Witness device(kForever);
  const Micros stamp = palpate::monotonic_now();
  Display display(stamp), shadow(stamp);
  HapticLoop loop(device, {&display.haptic, &shadow.haptic}, {false, 4096});
  loop.start();
  palpate::TickRecord tick;
  std::array<palpate::DisplayRecord, 2> row;
  std::vector<Micros> seen;
  const auto take_all = [&] {
    while (loop.recorder().take(tick, row)) {
      seen.push_back(tick.t);
      CHECK((row[0].wrench.force - row[1].wrench.force).norm() < 1e-9);
    }
  };
  while (seen.size() < 60) {
    take_all();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  loop.stop();
  take_all();
  CHECK(seen.size() == loop.stats().ticks);
  CHECK(loop.recorder().missed() == 0);
  CHECK(tick.has_patch);
  for (std::size_t i = 0; i < seen.size(); ++i) REQUIRE(seen[i] == device.read_at[i]);
}

TEST_CASE("What is recorded and reported is the share of the force that the hand feels", "[realtime]") {
  Witness device(400);
  device.share = 0.25;
  Display display;
  HapticLoop loop(device, {&display.haptic}, {false, 1000});
  loop.start();
  for (int ms = 0; ms < 20'000 && loop.running(); ++ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  loop.stop();
  palpate::TickRecord tick;
  std::array<palpate::DisplayRecord, 1> row;
  std::size_t k = 0;
  double most_n = 0;
  for (; loop.recorder().take(tick, row); ++k) {
    REQUIRE(k < device.written.size());
    CHECK(row[0].wrench.force == 0.25 * device.written[k]);
    most_n = std::max(most_n, row[0].wrench.force.norm());
  }
  CHECK(k == 400);
  CHECK(most_n > 0);
  CHECK(loop.stats().force_max_n == most_n);
}

TEST_CASE("What the operating system granted or denied is said in one line", "[realtime]") {
  CHECK(palpate::describe(palpate::RealtimeStatus{}) == "real time: off");
  CHECK(palpate::describe(palpate::RealtimeStatus{true, true, true, true}) == "real time: granted");
  const std::string denied = palpate::describe(palpate::RealtimeStatus{true, false, true, true});
  CHECK_THAT(denied, Catch::Contains("denied") && Catch::Contains("priority") && !Catch::Contains("memory"));
  CHECK(denied.find('\n') == std::string::npos);
}
