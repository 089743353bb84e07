// Cases that end in zero force: a device without limits, that hangs, vanishes, jumps, freezes; a loop that stands still. Only
// what must hold on any machine, however late, is asserted.
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "client/io/device_limits.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/reading_check.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"
#include "tests/support/felt_device.hpp"
#include "tests/support/patches.hpp"

using namespace palpate;

namespace {

/// Follows the test's commands, and records the written forces in order.
class Puppet final : public Device {
 public:
  Puppet() { written.reserve(200'000); }
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros) noexcept override {
    while (hang_read) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const int n = readings.fetch_add(1);
    const double tremor = frozen ? 0 : 3e-5 * (n % 2);
    DeviceReading reading{Vec3(jump.load() + tremor, 0, -0.005), state};
    if (state != DeviceState::ok) reading.reason = "the plug was pulled";
    return reading;
  }
  void write(const Wrench& wrench) noexcept override {
    while (hang_write) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    written.push_back(halted ? Vec3(Vec3::Zero()) : wrench.force);
    shown = written.back().norm();
    writes = static_cast<int>(written.size());
  }
  void stop() noexcept override { shown = 0, ++stops; }
  void halt() noexcept override { halted = true, shown = 0, ++halts; }
  void resume() noexcept override { halted = false; }

  std::atomic<bool> hang_read{false}, hang_write{false}, frozen{false}, halted{false};
  std::atomic<DeviceState> state{DeviceState::ok};
  std::atomic<double> jump{0}, shown{0};
  std::atomic<int> readings{0}, writes{0}, stops{0}, halts{0};
  std::vector<Vec3> written;  ///< by the loop; read after it has ended, or up to `writes`

 private:
  DeviceCaps caps_ = test::felt_caps();
};

/// A constant 2 N, for as long as the test takes.
struct Pushing {
  Pushing() { give(); }
  void give() {
    Patch patch;
    patch.constant = true;
    patch.seq = ++seq;
    patch.stamp = monotonic_now();
    patch.force = Vec3(0, 0, 2);
    patch.valid_for = Micros{60'000'000};
    patch.trust_radius_m = 1;
    slot->back() = PatchPlayer(patch);
    slot->publish();
  }
  std::uint32_t seq = 0;
  std::unique_ptr<LatestSlot<PatchPlayer>> slot = std::make_unique<LatestSlot<PatchPlayer>>();
  std::unique_ptr<SampleRing> samples = std::make_unique<SampleRing>();
  HapticTick haptic{*slot, *samples, {}};
};

template <class Condition>
bool in_time(Condition condition) {
  for (const auto end = monotonic_now() + Micros{30'000'000}; monotonic_now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// Returns true if, from the write `from` on, no force grows by more per tick than the fastest ramp. (It may also end at once, as
/// the watchdog acts on a machine that stalls long enough.)
bool grows_by_ramps(const Puppet& device, std::size_t from) {
  double before = 0;
  for (std::size_t i = from; i < device.written.size(); ++i) {
    const double force = device.written[i].norm();
    if (force - before > 2.0 / HapticLoop::kRampTicks + 1e-9) return false;
    before = force;
  }
  return true;
}

struct Running {
  Puppet device;
  Pushing display;
  HapticLoop loop{device, {&display.haptic}, {false, 0, PassivityMode::on}};
  Running() {
    loop.start();
    REQUIRE(whole());
  }
  /// Waits until the force is complete, while patches keep coming.
  bool whole() {
    return in_time([this] {
      display.give();
      return device.shown == 2;
    });
  }
};

}  // namespace

TEST_CASE("A device that renders a force and does not say its limits is refused by name of what is missing", "[realtime]") {
  const auto refused = [](const DeviceCaps& caps, const char* what) {
    CHECK_THROWS_WITH(limits_of(caps, PassivityMode::on), Catch::Contains("device stand-in") && Catch::Contains(what));
    CHECK_THROWS_AS(limits_of(caps, PassivityMode::on), InputError);
  };
  const DeviceCaps whole = test::felt_caps();
  const GuardLimits limits = limits_of(whole, PassivityMode::on);
  CHECK(limits.force_max_n == 8.5);
  CHECK(limits.slew_max_n_s == 2000);
  CHECK(limits.stiffness_max_n_m == 800);
  CHECK(limits.velocity_max_m_s == 2);
  CHECK(limits.force_continuous_n == 8.5);
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    const std::pair<double DeviceCaps::*, const char*> fields[] = {{&DeviceCaps::force_max_n, "peak force"},
                                                                   {&DeviceCaps::force_continuous_n, "continuous force"},
                                                                   {&DeviceCaps::slew_max_n_s, "slew"},
                                                                   {&DeviceCaps::stiffness_max_n_m, "stiffness"},
                                                                   {&DeviceCaps::velocity_max_m_s, "speed"}};
    for (const auto& [field, name] : fields) {
      DeviceCaps caps = whole;
      caps.*field = bad;
      refused(caps, name);
    }
  }
  DeviceCaps nowhere = whole;
  nowhere.workspace.setEmpty();
  refused(nowhere, "workspace");
  DeviceCaps unfelt;
  unfelt.renders_force = false;
  CHECK(limits_of(unfelt, PassivityMode::on).force_max_n == 0);
}

TEST_CASE("A loop does not begin with a device without limits", "[realtime]") {
  class Bare final : public Device {
   public:
    const DeviceCaps& caps() const override { return caps_; }
    DeviceReading read(Micros) noexcept override { return {}; }
    void write(const Wrench&) noexcept override {}
    void stop() noexcept override {}

   private:
    DeviceCaps caps_;
  } device;
  Pushing display;
  CHECK_THROWS_AS(HapticLoop(device, {&display.haptic}, {false, 0}), InputError);
}

TEST_CASE("A call into the device that does not come back is answered by the watchdog with zero force", "[realtime]") {
  const bool writes = GENERATE(false, true);
  auto run = std::make_unique<Running>();
  (writes ? run->device.hang_write : run->device.hang_read) = true;
  REQUIRE(in_time([&] { return run->device.halts > 0; }));
  CHECK(run->device.shown == 0);
  CHECK(run->loop.halts() >= 1);
  CHECK(run->loop.running());

  SECTION("and when it comes back after all the force begins at zero") {
    run->device.hang_read = run->device.hang_write = false;
    CHECK(run->whole());
    run->loop.stop();
    CHECK_FALSE(run->loop.stuck());
    CHECK(run->loop.stats().halts >= 1);
    CHECK(grows_by_ramps(run->device, 0));
  }
  SECTION("and a loop that is stopped meanwhile leaves it behind, halted") {
    run->loop.stop();
    CHECK(run->loop.stuck());
    CHECK(run->device.halted);
    run->device.hang_read = run->device.hang_write = false;
  }
}

TEST_CASE("A device that vanishes is not written to, and when it is back the force begins at zero", "[realtime]") {
  Running run;
  const DeviceState state = GENERATE(DeviceState::gone, DeviceState::fault, DeviceState::not_ready);
  run.device.state = state;
  const DeviceNote* note = nullptr;
  REQUIRE(in_time([&] { return (note = run.loop.changed()) != nullptr; }));
  CHECK(note->state == state);
  CHECK(note->reason.text() == "the plug was pulled");
  const int writes = run.device.writes, readings = run.device.readings;
  REQUIRE(in_time([&] { return run.device.readings > readings + 50; }));
  CHECK(run.device.writes == writes);
  CHECK(run.loop.at_zero());
  run.device.state = DeviceState::ok;
  CHECK(run.whole());
  REQUIRE(in_time([&] { return (note = run.loop.changed()) != nullptr; }));
  CHECK(note->state == DeviceState::ok);
  run.loop.stop();
  CHECK(run.loop.stats().away >= 50);
  CHECK_FALSE(run.loop.stats().device_ended);
  CHECK(run.device.stops == 1);
  CHECK(grows_by_ramps(run.device, static_cast<std::size_t>(writes)));
}

TEST_CASE("A device that is gone when the loop stops is stopped without being written to", "[realtime]") {
  Running run;
  run.device.state = DeviceState::gone;
  REQUIRE(in_time([&] { return run.loop.at_zero(); }));
  const int writes = run.device.writes;
  run.loop.stop();
  CHECK(run.device.writes == writes);
  CHECK(run.device.stops == 1);
}

TEST_CASE("An encoder that freezes while the hand is pushed ends in zero force, and one that moves again in a ramp",
          "[realtime]") {
  Running run;
  run.device.frozen = true;
  REQUIRE(in_time([&] {
    run.display.give();
    return run.loop.at_zero();
  }));
  const DeviceNote* const note = run.loop.changed();
  REQUIRE(note != nullptr);
  CHECK(note->state == DeviceState::fault);
  CHECK(note->reason.text() == describe(ReadingFault::frozen));
  run.device.frozen = false;
  CHECK(run.whole());
  run.loop.stop();
  CHECK(grows_by_ramps(run.device, 0));
  CHECK(run.loop.stats().not_believed > 0);
}

TEST_CASE("Held, the loop shows no force, and lets it come back by a ramp", "[realtime]") {
  Running run;
  run.loop.hold(true);
  REQUIRE(in_time([&] { return run.loop.at_zero(); }));
  run.loop.hold(false);
  CHECK(run.whole());
  run.loop.stop();
  CHECK(grows_by_ramps(run.device, 0));
}

TEST_CASE("A reading that cannot be is told from one that is late", "[realtime]") {
  ReadingCheck check(test::felt_caps());
  Micros t{1'000'000};
  const auto look = [&](const Vec3& at, double force_n = 0, Micros passed = kTick) {
    return check.look(at, t += passed, force_n);
  };
  CHECK(look(Vec3(0.05, 0, 0)) == ReadingFault::none);
  CHECK(look(Vec3(0.0535, 0, 0)) == ReadingFault::none);  // 3.5 m/s with a limit of 2 m/s: within twice the limit
  CHECK(look(Vec3(0.0580, 0, 0)) == ReadingFault::jumped);
  CHECK(look(Vec3(0.0580, 0, 0)) == ReadingFault::none);
  CHECK(look(Vec3(0.0780, 0, 0), 0, 10 * kTick) == ReadingFault::none);  // late
  CHECK(look(Vec3(0.1, 0, 0), 0, 10 * kTick) == ReadingFault::none);
  CHECK(look(Vec3(0.119, 0, 0), 0, 10 * kTick) == ReadingFault::none);  // a tenth of 0.2 m beyond its edge
  CHECK(look(Vec3(0.121, 0, 0)) == ReadingFault::outside);
  CHECK(look(Vec3(0.118, 0, 0)) == ReadingFault::none);
}

TEST_CASE("A tool that rests is no frozen encoder unless it is pushed", "[realtime]") {
  ReadingCheck check(test::felt_caps());
  Micros t{1'000'000};
  const auto faults = [&](double force_n, int ticks) {
    int count = 0;
    for (int k = 0; k < ticks; ++k) count += check.look(Vec3(0.01, 0, 0), t += kTick, force_n) == ReadingFault::frozen;
    return count;
  };
  CHECK(faults(1.0, 1000) == 0);  // it has not moved at all yet
  check.look(Vec3(0.0101, 0, 0), t += kTick, 1.0);
  CHECK(faults(0.2, 5000) == 0);
  CHECK(faults(1.0, ReadingCheck::kFrozenTicks - 1) == 0);
  CHECK(faults(1.0, 2) > 0);
  CHECK(faults(0.0, 100) == 100);  // the force is gone, and it still does not move
  CHECK(check.look(Vec3(0.0102, 0, 0), t += kTick, 0.0) == ReadingFault::none);
  CHECK(faults(1.0, 100) == 0);
  check.restart();
  CHECK(faults(1.0, 1000) == 0);
}

TEST_CASE("Whoever renders no force may rest, jump and be anywhere", "[realtime]") {
  DeviceCaps caps;
  caps.renders_force = false;
  ReadingCheck check(caps);
  Micros t{1'000'000};
  for (int k = 0; k < 2000; ++k) CHECK(check.look(Vec3(k / 1000, 0, 0), t += kTick, 5) == ReadingFault::none);
}
