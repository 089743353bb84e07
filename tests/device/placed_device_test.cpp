#include "client/device/placed_device.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

namespace {

/// Is where it is told to be, and remembers the last force.
struct HandHeld final : Device {
  DeviceCaps held_caps;
  DeviceReading reading;
  Vec3* felt;
  explicit HandHeld(Vec3* where) : felt(where) { reading.state = DeviceState::ok; }
  const DeviceCaps& caps() const override { return held_caps; }
  DeviceReading read(Micros) noexcept override { return reading; }
  void write(const Vec3& force) noexcept override { *felt = force; }
  void stop() noexcept override { *felt = Vec3::Zero(); }
};

struct PlacedBench {
  Vec3 felt = Vec3::Zero();
  HandHeld* hand;
  std::unique_ptr<PlacedDevice> placed;
  explicit PlacedBench(const Vec3& home) {
    auto device = std::make_unique<HandHeld>(&felt);
    hand = device.get();
    placed = std::make_unique<PlacedDevice>(std::move(device), home);
  }
};

}  // namespace

TEST_CASE("A held device stands at home without force until it starts, then moves from there as the hand does", "[device]") {
  PlacedBench bench(Vec3(0.05, 0.05, 0.1));
  bench.hand->reading.position = Vec3(0.2, -0.1, 0.03);
  CHECK(bench.placed->read(Micros{0}).position == Vec3(0.05, 0.05, 0.1));
  bench.placed->write(Vec3(0, 0, 4));
  CHECK(bench.felt == Vec3(Vec3::Zero()));
  bench.placed->start(Micros{1'000});
  CHECK((bench.placed->read(Micros{1'000}).position - Vec3(0.05, 0.05, 0.1)).norm() < 1e-15);
  bench.hand->reading.position += Vec3(0.001, 0.002, -0.003);
  CHECK((bench.placed->read(Micros{2'000}).position - Vec3(0.051, 0.052, 0.097)).norm() < 1e-12);
}

TEST_CASE("The workspace of a held device holds every place that it can get to from any start", "[device]") {
  Vec3 felt;
  auto device = std::make_unique<HandHeld>(&felt);
  device->held_caps.workspace = Eigen::AlignedBox3d(Vec3(-0.2, -0.1, 0), Vec3(0.1, 0.1, 0.3));
  const PlacedDevice placed(std::move(device), Vec3(1, 1, 1));
  CHECK((placed.caps().workspace.min() - Vec3(0.7, 0.8, 0.7)).norm() < 1e-12);
  CHECK((placed.caps().workspace.max() - Vec3(1.3, 1.2, 1.3)).norm() < 1e-12);
}

TEST_CASE("The force of a held device grows evenly from nothing after its start and after every fault", "[device]") {
  PlacedBench bench(Vec3::Zero());
  bench.placed->start(Micros{0});
  for (int round = 0; round < 2; ++round) {
    bench.hand->reading.state = DeviceState::ok;
    for (int i = 1; i <= 2 * PlacedDevice::kRiseTicks; ++i) {
      bench.placed->read(Micros{1'000 * i});
      bench.placed->write(Vec3(0, 0, 4));
      CHECK(bench.felt.z() == Approx(4.0 * std::min(1.0, i / 50.0)));
    }
    bench.hand->reading.state = DeviceState::fault;
    CHECK(bench.placed->read(Micros{200'000}).state == DeviceState::fault);
  }
}
