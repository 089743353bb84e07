// The whole loop of server, link, client, host and firmware in virtual time: the force at a device of the HID profile, whose
// mechanics are the simulated Phantom, against that of the simulated Phantom alone.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <vector>

#include "bench/fidelity/join.hpp"
#include "bench/world/world.hpp"
#include "client/device/hid/force_profile.hpp"
#include "tests/client/device/hid/bench_transport.hpp"

using namespace palpate;

namespace {

constexpr double kProfileQuantumN = 1e-3;
constexpr int kHidPressMs = 1500;

/// The Phantom without quantisation, so that only that of the profile remains; `profile`: behind firmware and host.
class ComparedPhantom final : public MotionDevice {
 public:
  ComparedPhantom(const Motion& motion, bool profile, std::shared_ptr<std::vector<Vec3>> felt)
      : phantom_(motion, hand()), through_profile_(profile), felt_(std::move(felt)), bench_(limits()), cable_(bench_) {
    clock_.wait_for_start();
    phantom_.wait_for_start();
    profile_.begin(cable_);
  }
  const DeviceCaps& caps() const override { return phantom_.caps(); }

  DeviceReading read(Micros now) noexcept override {
    if (!moves_ && clock_.started(now)) phantom_.start(now - clock_.elapsed(now));
    moves_ = moves_ || clock_.started(now);
    const DeviceReading reading = phantom_.read(now);
    if (!through_profile_) return reading;
    for (int i = 0; i < 3; ++i) bench_.sensors.position_nm[i] = static_cast<std::int32_t>(std::lround(reading.position[i] * 1e9));
    bench_.step();
    std::array<std::byte, FORCE_HID_INPUT_BYTES> report{};
    cable_.read(report, Micros{0});
    profile_.take(report, input_);
    return profile_.read(input_, now);
  }

  void write(const Wrench& wrench) noexcept override {
    if (through_profile_) {
      profile_.send(cable_, {wrench, true, true}, Micros{bench_.now_us});
      const auto rendered = bench_.step(0);
      phantom_.write(Vec3(rendered[0], rendered[1], rendered[2]) * 1e-3);
    } else {
      phantom_.write(wrench);
    }
    if (moves_) felt_->push_back(phantom_.force());
  }
  void stop() noexcept override { phantom_.stop(); }

 private:
  static SimPhantomOptions hand() {
    SimPhantomOptions options;
    options.hand = *hand_from_name("firm");
    options.position_step_m = options.force_step_n = 0;
    return options;
  }
  static force_hid_limits limits() {
    force_hid_limits limits = test::bench_limits();
    limits.heat_time_ds = 0;
    return limits;
  }

  SimPhantom phantom_;
  bool through_profile_, moves_ = false;
  std::shared_ptr<std::vector<Vec3>> felt_;
  test::BenchDevice bench_;
  test::BenchTransport cable_;
  ForceProfile profile_;
  HidInput input_;
};

std::vector<Vec3> felt_in_world(bool through_profile) {
  const Scene scene = load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json");
  const Vec3 home = scene.body.nodes[static_cast<std::size_t>(scene.tool.node)];
  const Motion press({{0.0, home}, {0.2, home}, {0.6, home + Vec3(0.004, 0.002, -0.012)}, {1.5, home + Vec3(-0.003, 0, -0.008)}});
  World world(scene, {});
  ClientOptions client;
  client.hello.station = "press";
  client.hello.scheme = Scheme::port;
  client.guard.force_max_n = 8.5;
  client.guard.slew_max_n_s = SimPhantom::kSlewMaxNS;
  const LinkSpec link{.latency = Micros{15'000}};
  const auto felt = std::make_shared<std::vector<Vec3>>();
  WorldStation& station = world.add_station(client, std::make_unique<ComparedPhantom>(press, through_profile, felt), link);
  WorldStation* const stations[] = {&station};
  const Micros begin = join(world, stations, scene, std::span(&press, 1), Scheme::port, link, 20);
  station.device().start(station.clock(begin));
  world.run_until(begin + Micros{1'000 * kHidPressMs});
  return *felt;
}

}  // namespace

TEST_CASE("A press felt through the HID profile is the press of the simulated Phantom, in the same tick, within one quantum") {
  const auto sim = felt_in_world(false), hid = felt_in_world(true);
  REQUIRE(sim.size() == hid.size());
  REQUIRE(sim.size() >= kHidPressMs);
  double apart = 0, strongest = 0;
  for (std::size_t i = 0; i < sim.size(); ++i) {
    apart = std::max(apart, (sim[i] - hid[i]).cwiseAbs().maxCoeff());
    strongest = std::max(strongest, sim[i].norm());
  }
  CAPTURE(apart);
  CHECK(strongest > 1.0);
  // Half a quantum is rounded off here, and its effect on the motion returns through the body.
  CHECK(apart <= kProfileQuantumN);
  CHECK(apart > 0);
}
