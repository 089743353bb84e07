// The whole loop of server, link, client and adapter in virtual time, felt through a vendor's calls: the force at the device
// against that of the simulated Phantom inside the stand-in.
#include <catch2/catch.hpp>
#include <functional>
#include <memory>

#include "bench/fidelity/join.hpp"
#include "bench/world/world.hpp"
#include "client/device/forcedimension/forcedimension_device.hpp"
#include "client/device/openhaptics/openhaptics_device.hpp"
#include "tests/client/device/load_standin.hpp"

using namespace palpate;

namespace {

const std::string kVendorSource = PALPATE_SOURCE_DIR;
constexpr double kQuantumN = 0.07;
constexpr int kPressMs = 1500;

/// A stand-in and its adapter, whose milliseconds advance with those of the world.
class LockstepDevice final : public MotionDevice {
 public:
  /// `first` receives the tick of the stand-in's log at which the motion begins.
  LockstepDevice(Standin& standin, std::unique_ptr<Device> adapter, std::function<void()> turn,
                 std::shared_ptr<std::size_t> first)
      : standin_(standin), adapter_(std::move(adapter)), turn_(std::move(turn)), first_(std::move(first)) {
    clock_.wait_for_start();
  }
  const DeviceCaps& caps() const override { return adapter_->caps(); }
  DeviceReading read(Micros now) noexcept override {
    if (!moves_ && clock_.started(now)) {
      standin_.start(clock_.elapsed(now));
      *first_ = standin_.log().size();
      moves_ = true;
    }
    standin_.tick();
    if (turn_) turn_();
    return adapter_->read(now);
  }
  void write(const Wrench& wrench) noexcept override { adapter_->write(wrench); }
  void stop() noexcept override { adapter_->stop(); }

 private:
  Standin& standin_;
  std::unique_ptr<Device> adapter_;
  std::function<void()> turn_;
  std::shared_ptr<std::size_t> first_;
  bool moves_ = false;
};

/// The simulated Phantom itself, with its force written `late` ticks later.
class LatePhantom final : public MotionDevice {
 public:
  LatePhantom(const Motion& motion, const SimPhantomOptions& hand, int late, std::shared_ptr<std::vector<Vec3>> felt)
      : phantom_(motion, hand), late_(late), felt_(std::move(felt)) {
    clock_.wait_for_start();
    phantom_.wait_for_start();
  }
  const DeviceCaps& caps() const override { return phantom_.caps(); }
  DeviceReading read(Micros now) noexcept override {
    if (!moves_ && clock_.started(now)) phantom_.start(now - clock_.elapsed(now));
    moves_ = moves_ || clock_.started(now);
    const DeviceReading reading = phantom_.read(now);
    if (late_ > 0) render(waiting_);
    return reading;
  }
  void write(const Wrench& wrench) noexcept override {
    if (late_ > 0)
      waiting_ = wrench;
    else
      render(wrench);
  }
  void stop() noexcept override { phantom_.stop(); }

 private:
  void render(const Wrench& wrench) {
    phantom_.write(wrench);
    if (moves_) felt_->push_back(phantom_.force());
  }
  SimPhantom phantom_;
  int late_;
  std::shared_ptr<std::vector<Vec3>> felt_;
  Wrench waiting_;
  bool moves_ = false;
};

Motion press_cube(const Scene& scene) {
  const Vec3 home = scene.body.nodes[static_cast<std::size_t>(scene.tool.node)];
  return Motion({{0.0, home}, {0.2, home}, {0.6, home + Vec3(0.004, 0.002, -0.012)}, {1.5, home + Vec3(-0.003, 0, -0.008)}});
}

SimPhantomOptions pressing_hand() {
  SimPhantomOptions hand;
  hand.hand = *hand_from_name("firm");
  return hand;
}

/// Runs the device through a press of the cube in the world.
void feel_press(const Scene& scene, const Motion& press, std::unique_ptr<MotionDevice> device) {
  World world(scene, {});
  ClientOptions client;
  client.hello.station = "press";
  client.hello.scheme = Scheme::port;
  client.guard.force_max_n = 8.5;
  client.guard.slew_max_n_s = SimPhantom::kSlewMaxNS;
  const LinkSpec link{.latency = Micros{15'000}};
  WorldStation& station = world.add_station(client, std::move(device), link);
  WorldStation* const stations[] = {&station};
  const Micros begin = join(world, stations, scene, std::span(&press, 1), Scheme::port, link, 20);
  station.device().start(station.clock(begin));
  world.run_until(begin + Micros{1'000 * kPressMs});
}

/// Forces of the simulated Phantom alone, tick by tick from the beginning of the press.
std::vector<Vec3> felt_by_sim(const Scene& scene, int late) {
  const auto felt = std::make_shared<std::vector<Vec3>>();
  feel_press(scene, press_cube(scene), std::make_unique<LatePhantom>(press_cube(scene), pressing_hand(), late, felt));
  return *felt;
}

/// The same through an adapter.
template <class MakeAdapter>
std::vector<Vec3> felt_through(Standin& standin, const Scene& scene, MakeAdapter make_adapter) {
  standin.begin(press_cube(scene), pressing_hand());
  standin.by_hand(true);
  standin.wait_for_start();
  const auto first = std::make_shared<std::size_t>(0);
  feel_press(scene, press_cube(scene), make_adapter(first));
  std::vector<Vec3> felt;
  const auto log = standin.log();
  for (std::size_t i = *first; i < log.size(); ++i) felt.push_back(log[i].force);
  CHECK(standin.breaches() == std::vector<std::string>{});
  return felt;
}

/// Largest difference along an axis, with `b` shifted by `shift` ticks.
double apart(const std::vector<Vec3>& a, const std::vector<Vec3>& b, std::size_t shift) {
  double most = 0;
  for (std::size_t i = 0; i < a.size() && i + shift < b.size(); ++i)
    most = std::max(most, (a[i] - b[i + shift]).cwiseAbs().maxCoeff());
  return most;
}

double strongest(const std::vector<Vec3>& forces) {
  double most = 0;
  for (const Vec3& force : forces) most = std::max(most, force.norm());
  return most;
}

}  // namespace

TEST_CASE("A press felt through OpenHaptics' calls is the press of the simulated Phantom, a tick later, within one quantum") {
  const Scene cube = load_scene(kVendorSource + "/scenes/cube6.json");
  Standin& standin = load_standin("hd", "PALPATE_LIBHD");
  const auto felt = felt_through(standin, cube, [&](const std::shared_ptr<std::size_t>& first) {
    return std::make_unique<LockstepDevice>(standin, std::make_unique<OpenHapticsDevice>(), nullptr, first);
  });
  const auto late = felt_by_sim(cube, 1), sim = felt_by_sim(cube, 0);
  REQUIRE(felt.size() >= kPressMs);
  REQUIRE(strongest(sim) > 1.0);
  CHECK(apart(late, felt, 0) <= kQuantumN * 1.001);
  CHECK(apart(sim, felt, 1) <= kQuantumN * 1.001);
}

TEST_CASE(
    "A press felt through Force Dimension's calls is the press of the simulated Phantom, a tick later, within one quantum") {
  const Scene cube = load_scene(kVendorSource + "/scenes/cube6.json");
  Standin& standin = load_standin("dhd", "PALPATE_LIBDHD");
  const auto felt = felt_through(standin, cube, [&](const std::shared_ptr<std::size_t>& first) {
    auto adapter = std::make_unique<ForceDimensionDevice>(ForceDimensionOptions{0, Micros{0}, false});
    ForceDimensionDevice* const driver = adapter.get();
    return std::make_unique<LockstepDevice>(
        standin, std::move(adapter), [driver] { driver->turn(); }, first);
  });
  const auto late = felt_by_sim(cube, 1), sim = felt_by_sim(cube, 0);
  REQUIRE(felt.size() >= kPressMs);
  CHECK(apart(late, felt, 0) <= kQuantumN * 1.001);
  CHECK(apart(sim, felt, 1) <= kQuantumN * 1.001);
}
