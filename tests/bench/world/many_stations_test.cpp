// Sixteen hands on one body over their own links: none is stalled, and each feels the body.
#include <catch2/catch.hpp>
#include <cmath>

#include "bench/world/world.hpp"
#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

constexpr int kHands = 16;

/// Down onto the top of touch-cube at its own place, and up and down there.
Motion press(int k) {
  const Vec3 place(0.015 + 0.025 * (k % 4), 0.015 + 0.025 * (k / 4), 0.075);
  std::vector<MotionPoint> points;
  for (int i = 0; i <= 6000; ++i) {
    const double t = i * 1e-3;
    const double depth = 0.006 * std::min(1.0, t / 0.5) + 0.002 * std::sin((4 + 0.3 * k) * t);
    points.push_back({t, place + Vec3(0, 0, 0.002 - depth)});
  }
  return Motion(std::move(points));
}

struct Felt {
  int ticks = 0, contacts = 0, with_patch = 0;
  double most_n = 0;
  Micros oldest{};
  bool finite = true;
};

}  // namespace

TEST_CASE("Sixteen stations of different links press one body at once, leave and come back, and none stalls another") {
  Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json");
  World world(scene, {});
  std::vector<WorldStation*> stations;
  std::vector<Felt> felt(kHands);
  const auto one_way_ms = [](int k) { return k == 15 ? 250 : 5 * k; };
  for (int k = 0; k < kHands; ++k) {
    ClientOptions options;
    options.hello.station = "hand " + std::to_string(k);
    options.hello.scheme = k % 5 == 4 ? Scheme::tangent : Scheme::port;
    LinkSpec link;
    link.latency = Micros{1000 * one_way_ms(k)};
    link.jitter = Micros{500 * (k % 4)};
    link.loss = k % 3 == 2 ? 0.15 : 0.0;
    link.seed = static_cast<std::uint64_t>(10 * k + 1);
    stations.push_back(&world.add_station(options, std::make_unique<ReplayDevice>(press(k)), link));
    stations.back()->on_tick = [&, k](Micros t, const Vec3&, const TickOutput& out) {
      Felt& f = felt[static_cast<std::size_t>(k)];
      f.finite &= out.force.allFinite();
      if (t < Micros{1'800'000}) return;
      ++f.ticks;
      f.contacts += out.contact;
      f.with_patch += out.has_patch;
      f.most_n = std::max(f.most_n, out.force.norm());
      f.oldest = std::max(f.oldest, out.patch_age);
    };
  }
  world.run_until(Micros{3'000'000});
  CHECK(world.server().station_count() == kHands);
  CHECK(world.server().counts().frames_failed == 0);
  CHECK(world.server().counts().frames_waiting < 10);
  for (int k = 0; k < kHands; ++k) {
    const Felt& f = felt[static_cast<std::size_t>(k)];
    INFO("hand " << k);
    CHECK(f.finite);
    CHECK(f.with_patch == f.ticks);
    CHECK(f.contacts > f.ticks / 2);
    CHECK(f.most_n > 0.1);
    CHECK(f.most_n < 30);
    // Own round trip, 75 ms of waiting for the others, frames and losses; the far one is not waited for.
    CHECK(f.oldest < Micros{1000 * (2 * one_way_ms(k) + 75 + 250)});
  }
  // One leaves without a goodbye, one with; fourteen are unaffected.
  stations[3]->device().stop();
  stations[3]->core().leave();
  for (Felt& f : felt) f = {};
  world.run_until(Micros{4'000'000});
  CHECK(world.server().station_count() == kHands - 1);
  for (int k = 0; k < kHands; ++k)
    if (k != 3) CHECK(felt[static_cast<std::size_t>(k)].with_patch == felt[static_cast<std::size_t>(k)].ticks);
  // Its name is free for another station.
  ClientOptions again;
  again.hello.station = "hand 3";
  again.hello.scheme = Scheme::port;
  WorldStation& back = world.add_station(again, std::make_unique<ReplayDevice>(press(3)), {});
  world.run_until(Micros{4'600'000});
  CHECK(back.core().link() == LinkState::joined);
  CHECK(back.core().counts().patches > 3);
}
