// Everything between a driver's thread and the 1 kHz loop allocates nothing and locks nothing on either side.
#include <catch2/catch.hpp>
#include <limits>
#include <memory>

#include "client/device/driver_exchange.hpp"
#include "client/device/reading_gate.hpp"
#include "client/mapping/mapped_device.hpp"
#include "tests/support/realtime_guard.hpp"

using namespace palpate;

namespace {

/// An adapter whose driver is stepped by its reader.
class Turned final : public Device {
 public:
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros now) noexcept override {
    DeviceReading reading;
    reading.state = DeviceState::ok;
    // Sometimes a NaN position, sometimes a fault of the driver.
    const auto tick = now.count() / 1000;
    reading.position =
        Vec3(0.001 * static_cast<double>(tick % 2), 0, tick % 500 == 0 ? std::numeric_limits<double>::quiet_NaN() : 0);
    if (tick % 700 == 0) gate_.refuse("it is too hot, and the reason is long enough for a string to take memory");
    rendered += exchange_.turn(gate_.pass(reading)).force.norm();
    return exchange_.read();
  }
  void write(const Wrench& wrench) noexcept override { exchange_.write(wrench); }
  void stop() noexcept override { exchange_.write({}); }
  void halt() noexcept override { exchange_.halt(); }
  void resume() noexcept override { exchange_.resume(); }

  double rendered = 0;

 private:
  DeviceCaps caps_;
  DriverExchange exchange_{1000};
  ReadingGate gate_{1000, 5};
};

}  // namespace

TEST_CASE("Readings and forces pass between a driver and the loop without memory or locks, faults included", "[realtime]") {
  Turned driver;
  MappedDevice device(driver, {}, {});
  device.start(Micros{1'000});
  int faults = 0;
  test::RealtimeGuard guard;
  for (int ms = 1; ms <= 3000; ++ms) {
    faults += device.read(Micros{1'000 * ms}).state == DeviceState::fault;
    device.write(Vec3(0, 0, 1));
    if (ms % 100 == 0) device.halt();
    if (ms % 100 == 10) device.resume();
  }
  CHECK(guard.end().none());
  CHECK(faults > 500);
  CHECK(driver.rendered > 10);
}
