#include "client/device/driver_exchange.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "client/device/reading_gate.hpp"

using namespace palpate;

namespace {

constexpr double kDriverHz = 1000;

DeviceReading at(double x) { return {Vec3(x, 0, 0), DeviceState::ok}; }

/// An exchange whose two sides are connected.
struct Met {
  DriverExchange exchange{kDriverHz};
  Met() {
    exchange.turn(at(0));
    exchange.read();
  }
};

}  // namespace

TEST_CASE("Of a driver and a loop that hand over, each gets the newest of the other", "[device]") {
  Met met;
  met.exchange.write(Vec3(1, 0, 0));
  met.exchange.write(Vec3(2, 0, 0));
  CHECK(met.exchange.turn(at(0.01)).force == Vec3(2, 0, 0));
  CHECK(met.exchange.turn(at(0.02)).force == Vec3(2, 0, 0));
  CHECK(met.exchange.read().position == Vec3(0.02, 0, 0));
}

TEST_CASE("A loop that is still for 20 ms gets no force, and has its force again when it goes on", "[device]") {
  for (const double hz : {500.0, 1000.0, 4000.0}) {
    DriverExchange exchange(hz);
    exchange.turn(at(0));
    exchange.read();
    exchange.write(Vec3(3, 0, 0));
    int turns = 0;
    while (exchange.turn(at(0)).force.x() > 0) ++turns;
    CHECK(turns == static_cast<int>(0.02 * hz));
    CHECK(exchange.turn(at(0)).force == Vec3(Vec3::Zero()));
    exchange.read();
    exchange.write(Vec3(1, 0, 0));
    CHECK(exchange.turn(at(0)).force == Vec3(1, 0, 0));
  }
}

TEST_CASE("A driver that is silent for 20 readings is gone, and there again with its next reading", "[device]") {
  Met met;
  met.exchange.turn(at(0.5));
  for (int i = 0; i < DriverExchange::kSilentReads; ++i) CHECK(met.exchange.read().ok());
  CHECK(met.exchange.read().state == DeviceState::gone);
  CHECK_FALSE(met.exchange.read().reason.text().empty());
  met.exchange.write(Vec3(5, 0, 0));
  CHECK(met.exchange.turn(at(0.5)).force == Vec3(Vec3::Zero()));
  CHECK(met.exchange.read().ok());
}

TEST_CASE("No force that is not finite, and none for a reading that is not ok or after halt, gets to a driver", "[device]") {
  Met met;
  met.exchange.write(Vec3(0, std::numeric_limits<double>::quiet_NaN(), 1));
  CHECK(met.exchange.turn(at(0)).force == Vec3(Vec3::Zero()));
  met.exchange.write(Vec3(0, 0, 1));
  CHECK(met.exchange.turn({Vec3::Zero(), DeviceState::fault}).force == Vec3(Vec3::Zero()));
  CHECK(met.exchange.turn(at(0)).force == Vec3(0, 0, 1));
  met.exchange.halt();
  met.exchange.write(Vec3(0, 0, 2));
  CHECK(met.exchange.turn(at(0)).force == Vec3(Vec3::Zero()));
  met.exchange.resume();
  CHECK(met.exchange.turn(at(0)).force == Vec3(0, 0, 2));
}

TEST_CASE("A jump is a fault until 100 ms of steady readings, a place that is no number as long", "[device]") {
  ReadingGate gate(kDriverHz, 5.0);
  for (int i = 0; i < 10; ++i) CHECK(gate.pass(at(0.004 * i)).ok());  // 4 m/s is fast, but no jump
  const DeviceReading jumped = gate.pass(at(0.1));
  CHECK(jumped.state == DeviceState::fault);
  CHECK_FALSE(jumped.reason.text().empty());
  int refused = 1;
  while (gate.pass(at(0.1)).state == DeviceState::fault) ++refused;
  CHECK(refused == 100);

  const DeviceReading nowhere = gate.pass(at(std::numeric_limits<double>::quiet_NaN()));
  CHECK(nowhere.state == DeviceState::fault);
  CHECK(nowhere.position.allFinite());
  CHECK(gate.pass(at(0.1)).state == DeviceState::fault);
}

TEST_CASE("A driver's fault lasts a second beyond its last word, and keeps its reason", "[device]") {
  ReadingGate gate(kDriverHz, 5.0);
  gate.refuse("too hot");
  for (int i = 0; i < 500; ++i) gate.pass(at(0));
  gate.refuse("too hot");
  int refused = 0;
  for (DeviceReading r = gate.pass(at(0)); r.state == DeviceState::fault; r = gate.pass(at(0))) {
    CHECK(r.reason.text() == "too hot");
    ++refused;
  }
  CHECK(refused == 1000);
}

TEST_CASE("A reason longer than there is room for is cut", "[device]") {
  const std::string text(200, 'x');
  CHECK(DeviceReason(text).text() == text.substr(0, DeviceReason::kMaxBytes));
}

TEST_CASE("A torque that is not a number is zero, and the force stays, until the reading ends both", "[device]") {
  Met met;
  met.exchange.write({Vec3(1, 0, 0), Vec3(0, std::nan(""), 0)});
  const Wrench given = met.exchange.turn(at(0));
  CHECK(given.force == Vec3(1, 0, 0));
  CHECK(given.torque == Vec3(Vec3::Zero()));
  met.exchange.write({Vec3(1, 0, 0), Vec3(0, 0.1, 0)});
  CHECK(met.exchange.turn(at(0)).torque == Vec3(0, 0.1, 0));
  CHECK(met.exchange.turn({Vec3::Zero(), DeviceState::fault}).zero());
}
