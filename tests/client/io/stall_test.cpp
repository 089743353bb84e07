// A stalled network thread must not be felt: the haptic thread never waits.
#include <catch2/catch.hpp>
#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "client/core/client_core.hpp"
#include "client/io/haptic_loop.hpp"
#include "common/io/monotonic.hpp"
#include "tests/support/felt_device.hpp"
#include "tests/support/patches.hpp"
#include "tests/support/realtime_guard.hpp"

using namespace palpate;

namespace {

constexpr Micros kStallEpoch{1'000'000'000};

ClientOptions named(const std::string& name) {
  ClientOptions options;
  options.hello.station = name;
  return options;
}

class Still final : public Device {
 public:
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros) noexcept override {
    readings.fetch_add(1);
    return {Vec3(0, 0, -0.005), DeviceState::ok};
  }
  void write(const Wrench&) noexcept override {}
  void stop() noexcept override {}
  std::atomic<int> readings{0};

 private:
  DeviceCaps caps_ = test::felt_caps();
};

}  // namespace

TEST_CASE("Three seconds of ticks without a network side allocate, lock and lose nothing but samples", "[realtime]") {
  ClientCore core(named("hand"), kStallEpoch);
  test::RealtimeGuard guard;
  TickOutput out;
  for (int ms = 1; ms <= 3000; ++ms) out = core.haptic().tick({kStallEpoch + ms * kTick, Vec3(0, 0, 0.001 * ms)});
  const auto faults = guard.end();
  CHECK(faults.none());
  CHECK(core.haptic().counts().ticks == 3000);
  CHECK(core.haptic().counts().samples_dropped >= 3000 - kSampleRing);
  CHECK(out.force.norm() == 0);
}

TEST_CASE("A patch that the network side has begun and not finished is not waited for", "[realtime]") {
  auto slot = std::make_unique<LatestSlot<PatchPlayer>>();
  auto samples = std::make_unique<SampleRing>();
  HapticTick haptic(*slot, *samples, {});
  Patch patch = test::attach_patch(8, 1, kStallEpoch);
  patch.force = Vec3(0, 0, 2);
  slot->back() = PatchPlayer(patch);
  slot->publish();
  for (int ms = 1; ms <= 100; ++ms) haptic.tick({kStallEpoch + ms * kTick, Vec3::Zero()});
  patch.seq = 2;
  slot->back() = PatchPlayer(patch);  // and there it stalls
  for (int ms = 101; ms <= 200; ++ms) {
    const TickOutput out = haptic.tick({kStallEpoch + ms * kTick, Vec3::Zero()});
    CHECK(out.has_patch);
    CHECK_FALSE(out.swapped);
  }
  slot->publish();
  CHECK(haptic.tick({kStallEpoch + 201 * kTick, Vec3::Zero()}).swapped);
}

TEST_CASE("The loop ticks on while the thread that drives the session is stuck", "[realtime]") {
  ClientCore core(named("hand"), monotonic_now());
  Still device;
  HapticLoop loop(device, {&core.haptic()}, {false, 0});
  loop.start();
  std::promise<void> release, stuck;
  std::thread network([&] {
    core.tick(monotonic_now());
    stuck.set_value();
    release.get_future().wait();  // as in a name lookup, with a full disk, or on a page fault
    core.tick(monotonic_now());
  });
  stuck.get_future().wait();
  const int before = device.readings;
  const auto end = monotonic_now() + Micros{20'000'000};
  while (device.readings < before + 300 && monotonic_now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  CHECK(device.readings >= before + 300);
  release.set_value();
  network.join();
  loop.stop();
}
