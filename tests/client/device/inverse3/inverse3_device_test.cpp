// The device over its stand-in's WebSocket on the loopback: threads, sockets and a service that misbehaves.
#include "client/device/inverse3/io/inverse3_device.hpp"

#include <catch2/catch.hpp>
#include <chrono>

#include "client/device/hardware/find_devices.hpp"
#include "client/device/hardware/open_device.hpp"
#include "client/io/haptic_loop.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"
#include "tests/client/device/standin/inverse3_service.hpp"
#include "tests/support/realtime_guard.hpp"

using namespace palpate;
using palpate::test::Inverse3Service;
using palpate::test::ServiceFault;

namespace {

constexpr int kPatienceMs = 20'000;

/// Runs once per millisecond, like the haptic loop, until `done` is true for the reading.
template <class Done>
bool loop(Device& device, const Vec3& force, Done done) {
  for (int ms = 0; ms < kPatienceMs; ++ms) {
    const DeviceReading reading = device.read(monotonic_now());
    if (reading.ok() && !reading.position.allFinite()) return false;
    device.write(force);
    if (done(reading)) return true;
    std::this_thread::sleep_for(Micros{1000});
  }
  return false;
}

std::unique_ptr<Inverse3Device> open(const Inverse3Service& service, const std::string& id = "") {
  Inverse3Options options;
  options.id = id;
  options.port = service.port();
  return std::make_unique<Inverse3Device>(options);
}

}  // namespace

TEST_CASE("Force written by the loop reaches the device, and positions come back, in both versions", "[inverse3]") {
  const auto format = GENERATE(Inverse3Format::v3_1, Inverse3Format::v3_5);
  Inverse3Service service({"049D"}, format);
  SimPhantomOptions hand;
  hand.hand = *hand_from_name("light");
  service.arm(0).begin(Motion::rest(Vec3(0.01, -0.02, 0.03), 1.0), hand);
  {
    const auto device = open(service);
    CHECK(device->caps().force_max_n == 5);
    CHECK(device->caps().model.find("Haply inverse3, device 049D, Inverse Service 3.") == 0);
    Vec3 position = Vec3::Zero();
    REQUIRE(loop(*device, Vec3(0.5, -0.25, 1), [&](const DeviceReading& reading) {
      if (reading.ok()) position = reading.position;
      if (reading.ok()) CHECK((position - Vec3(0.01, -0.02, 0.03)).norm() < 0.05);
      return service.force(0) == Vec3(0.5, -0.25, 1);
    }));
    CHECK((position - Vec3(0.01, -0.02, 0.03)).norm() < 0.02);  // it yields
    CHECK(device->exchanges().answers > 0);
    device->stop();
    CHECK(loop(*device, Vec3::Zero(), [&](const DeviceReading&) { return service.force(0) == Vec3::Zero(); }));
    CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service.force(0).x() == 1; }));
  }
  // Closed: the last command took the force away before the connection closed.
  CHECK(service.force(0) == Vec3::Zero());
  CHECK(service.breaches().empty());
}

TEST_CASE("halt() takes the force of an Inverse3 away until resume()", "[inverse3]") {
  Inverse3Service service({"049D"});
  const auto device = open(service);
  const auto felt = [&](const DeviceReading&) { return service.force(0).x() == 1; };
  REQUIRE(loop(*device, Vec3(1, 0, 0), felt));
  std::thread([&] { device->halt(); }).join();
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service.force(0) == Vec3::Zero(); }));
  device->resume();
  CHECK(loop(*device, Vec3(1, 0, 0), felt));
}

TEST_CASE("Two Inverse3 of one service are two hands, each selected by its id", "[inverse3]") {
  Inverse3Service service({"049D", "A14"});
  SimPhantomOptions still;
  service.arm(0).begin(Motion::rest(Vec3(-0.05, 0, 0), 1.0), still);
  service.arm(1).begin(Motion::rest(Vec3(0.05, 0, 0), 1.0), still);
  CHECK_THROWS_WITH(open(service), Catch::Contains("several fit; expected inverse3:ID with one of 049D, A14"));
  CHECK_THROWS_WITH(open(service, "B"), Catch::Contains("its service lists no device \"B\"; expected one of 049D, A14"));
  const auto left = open_hardware("inverse3:049D,port=" + std::to_string(service.port()));
  const auto right = open_hardware("inverse3:A14,port=" + std::to_string(service.port()));
  double left_x = 0, right_x = 0;
  REQUIRE(loop(*left, Vec3(0, 0, 1), [&](const DeviceReading& reading) {
    left_x = reading.position.x();
    const DeviceReading other = right->read(monotonic_now());
    right_x = other.position.x();
    right->write(Vec3(0, 2, 0));
    return reading.ok() && other.ok() && service.force(0) == Vec3(0, 0, 1) && service.force(1) == Vec3(0, 2, 0);
  }));
  CHECK(left_x < -0.03);
  CHECK(right_x > 0.03);
  service.arm(0).misbehave(StandinFault::lost);
  CHECK(loop(*left, Vec3(0, 0, 1), [](const DeviceReading& reading) { return reading.state == DeviceState::gone; }));
  CHECK(loop(*right, Vec3(0, 2, 0), [&](const DeviceReading& reading) { return reading.ok() && service.force(1).y() == 2; }));
  CHECK(service.breaches().empty());
}

TEST_CASE("A service that is absent or unusable is refused with what is wrong and what was expected", "[inverse3]") {
  std::uint16_t port = 0;
  {
    Inverse3Service service({"049D"});
    port = service.port();
    const auto [fault, words] = GENERATE(table<ServiceFault, std::string>(
        {{ServiceFault::refuses, "it accepts no WebSocket"},
         {ServiceFault::deaf, "it accepts a connection and does not answer"},
         {ServiceFault::mute, "it sends no list of its devices"},
         {ServiceFault::not_json, "its first message is no JSON object"},
         {ServiceFault::no_list, "its service lists no device; expected an Inverse3 that is plugged in and switched on"},
         {ServiceFault::huge, "its service sends messages of more than 256 kB"}}));
    service.misbehave(fault);
    CHECK_THROWS_WITH(open(service), Catch::Contains(words) && Catch::Contains("expected"));
    service.misbehave(ServiceFault::none);
    service.set_type("minverse");
    CHECK_THROWS_WITH(open(service), Catch::Contains("device 049D is of type minverse; expected an inverse3 or inverse3x"));
  }
  Inverse3Options options;
  options.port = port;
  CHECK_THROWS_WITH(Inverse3Device(options),
                    Catch::Contains("127.0.0.1:" + std::to_string(port) + ": nothing listens; expected Haply's"));
}

TEST_CASE("Every misbehaviour of the service ends the force in a state with its reason, and the hand returns when it is over",
          "[inverse3]") {
  const auto [fault, state, words] = GENERATE(
      table<ServiceFault, DeviceState, std::string>({{ServiceFault::not_json, DeviceState::gone, "no state of devices"},
                                                     {ServiceFault::too_large, DeviceState::gone, "no state of devices"},
                                                     {ServiceFault::no_list, DeviceState::gone, "no state of devices"},
                                                     {ServiceFault::text, DeviceState::fault, "not a number"},
                                                     {ServiceFault::far_away, DeviceState::fault, "out of its reach"},
                                                     {ServiceFault::other, DeviceState::gone, "does not list it"},
                                                     {ServiceFault::huge, DeviceState::gone, "more than 256 kB"},
                                                     {ServiceFault::slow, DeviceState::gone, "20 ms"},
                                                     {ServiceFault::closes, DeviceState::gone, "closed the connection"}}));
  Inverse3Service service({"049D"});
  const auto device = open(service);
  const auto felt = [&](const DeviceReading& reading) { return reading.ok() && service.force(0).x() == 1; };
  REQUIRE(loop(*device, Vec3(1, 0, 0), felt));
  service.misbehave(fault);
  CHECK(loop(*device, Vec3(1, 0, 0), [&, state = state, words = words](const DeviceReading& reading) {
    return reading.state == state && reading.reason.text().find(words) != std::string_view::npos;
  }));
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service.force(0) == Vec3::Zero(); }));
  service.misbehave(ServiceFault::none);
  CHECK(loop(*device, Vec3(1, 0, 0), felt));
  CHECK(service.breaches().empty());
}

TEST_CASE("A stalled service is gone within the silence that the loop allows, and what it meets first afterwards is zero force",
          "[inverse3]") {
  Inverse3Service service({"049D"});
  const auto device = open(service);
  const auto felt = [&](const DeviceReading& reading) { return reading.ok() && service.force(0).x() == 1; };
  REQUIRE(loop(*device, Vec3(1, 0, 0), felt));
  service.arm(0).misbehave(StandinFault::silent);
  DeviceReading gone;
  REQUIRE(
      loop(*device, Vec3(1, 0, 0), [&](const DeviceReading& reading) { return (gone = reading).state == DeviceState::gone; }));
  CHECK(gone.reason.text() == "its service has not answered for 20 ms");
  service.arm(0).misbehave(StandinFault::none);
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service.force(0) == Vec3::Zero(); }));
  CHECK(loop(*device, Vec3(1, 0, 0), felt));
}

TEST_CASE("A service that is killed and started again on its port gives the same device back, from zero force", "[inverse3]") {
  auto service = std::make_unique<Inverse3Service>(std::vector<std::string>{"049D"});
  const std::uint16_t port = service->port();
  const auto device = open(*service);
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service->force(0).x() == 1; }));
  service.reset();
  REQUIRE(loop(*device, Vec3(1, 0, 0), [](const DeviceReading& reading) { return reading.state == DeviceState::gone; }));
  service = std::make_unique<Inverse3Service>(std::vector<std::string>{"A14"}, Inverse3Format::v3_5, port);
  std::this_thread::sleep_for(Micros{1'500'000});  // time in which another device could be taken for it
  CHECK(device->read(monotonic_now()).state == DeviceState::gone);
  CHECK(service->commands() == 0);
  service.reset();
  service = std::make_unique<Inverse3Service>(std::vector<std::string>{"A14", "049D"}, Inverse3Format::v3_5, port);
  CHECK(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service->force(1).x() == 1; }));
  CHECK(service->force(0) == Vec3::Zero());
}

TEST_CASE("The 1 kHz loop runs on while the service stalls, and no force is written to a device that is gone", "[inverse3]") {
  // A busy machine that keeps the loop from running has the watchdog halt it: then the same is tried again.
  std::uint64_t halts = 1;
  for (int attempt = 0; halts > 0 && attempt < 20; ++attempt) {
    Inverse3Service service({"049D"});
    const auto device = open(service);
    LatestSlot<PatchPlayer> patches;
    SampleRing samples;
    HapticTick display(patches, samples, GuardLimits{});
    HapticLoop haptic(*device, {&display}, {});
    haptic.start();
    service.arm(0).misbehave(StandinFault::silent);
    std::this_thread::sleep_for(Micros{300'000});
    haptic.stop();
    CHECK(haptic.stats().late_us.below(1'000'000) > 50);  // it woke up
    CHECK(haptic.stats().force_max_n == 0);
    halts = haptic.stats().halts;
  }
  CHECK(halts == 0);
}

TEST_CASE("read, write, halt, resume and stop of an Inverse3 suit a real-time thread", "[inverse3]") {
  Inverse3Service service({"049D"});
  const auto device = open(service);
  REQUIRE(loop(*device, Vec3(1, 0, 0), [&](const DeviceReading&) { return service.force(0).x() == 1; }));
  test::RealtimeGuard guard;
  for (int n = 0; n < 500; ++n) {
    device->read(Micros{n});
    device->write(Vec3(1, 2, 3));
  }
  device->halt();
  device->resume();
  device->stop();
  CHECK(guard.end().none());
}

TEST_CASE("The settings of an Inverse3 are an id and a port", "[inverse3]") {
  CHECK(read_inverse3_options("").id.empty());
  CHECK(read_inverse3_options("").port == 10001);
  CHECK(read_inverse3_options("049D").id == "049D");
  CHECK(read_inverse3_options("049D,port=7").port == 7);
  CHECK(read_inverse3_options(",port=65535").port == 65535);
  for (const char* text : {"a,", "a,port", "a,port=", "a,port=0", "a,port=65536", "a,port=1x", "a,force-n=3", "a,port=1,port=2"})
    CHECK_THROWS_WITH(read_inverse3_options(text), Catch::Contains("expected port=NUMBER, 1 to 65535"));
  CHECK(is_hardware("inverse3"));
  CHECK(is_hardware("inverse3:049D"));
}

TEST_CASE("A running service is listed with its devices", "[inverse3]") {
  Inverse3Service service({"049D", "A14"});
  const auto listed = find_inverse3(service.port());
  REQUIRE(listed.size() == 2);
  CHECK(listed[0].id == "049D");
  CHECK(listed[1].id == "A14");
  FoundLibrary found{"inverse3", ""};
  found.works = "its service runs and lists 049D, A14";
  CHECK(describe({}, {found}).find("inverse3: its service runs and lists 049D, A14\n") != std::string::npos);
}
