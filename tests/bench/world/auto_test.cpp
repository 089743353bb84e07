// The scheme is left to the server: schemes that hands get for various costs of patches.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "bench/world/world.hpp"
#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

constexpr Micros kStep{5'000};
constexpr Micros kCheapPatch{6'000}, kCostlyPatch{60'000};

Scene scene_of(const char* name) { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name); }

/// Down onto the top of touch-cube at its own place, and slowly up and down there.
Motion press(int k, double length_s) {
  const Vec3 place(0.03 + 0.04 * (k % 2), 0.03 + 0.04 * (k / 2), 0.075);
  std::vector<MotionPoint> points;
  for (int i = 0; i <= static_cast<int>(length_s * 100); ++i) {
    const double t = i * 1e-2;
    points.push_back({t, place + Vec3(0, 0, 0.002 - 0.006 * std::min(1.0, t / 0.5) + 0.001 * std::sin(std::numbers::pi * t))});
  }
  return Motion(std::move(points));
}

ClientOptions hand(int k, SchemeAsked asked) {
  ClientOptions options;
  options.hello.station = "hand " + std::to_string(k);
  options.hello.scheme = asked;
  return options;
}

LinkSpec near_by() {
  LinkSpec link;
  link.latency = Micros{5'000};
  return link;
}

/// Options in which each patch of `hyper` has the given cost at a world time, and the shared rollouts cost `rollouts`.
WorldOptions charged(std::function<Micros(Micros)> hyper, Micros rollouts = {}) {
  WorldOptions options;
  options.frame_times = [hyper = std::move(hyper), rollouts](Micros now, const FrameJob& job, const FrameResult& result) {
    FrameTimes times{.step = kStep};
    for (const StationFrame& frame : result.stations)
      if (frame.patch && frame.patch->scheme == Scheme::hyper) times.patches += hyper(now);
    if (job.rollouts && times.patches > Micros{}) times.rollouts = rollouts;
    times.patches += times.rollouts;
    return times;
  };
  return options;
}

/// One hand for six seconds, whose nonlinear patches are expensive from second 2 to 3.
double hand_over_step_n(SchemeAsked asked, std::uint64_t& changes) {
  const Scene scene = scene_of("touch-cube.json");
  World world(scene,
              charged([](Micros t) { return t > Micros{2'000'000} && t < Micros{3'000'000} ? kCostlyPatch : kCheapPatch; }));
  WorldStation& station = world.add_station(hand(0, asked), std::make_unique<ReplayDevice>(press(0, 6)), near_by());
  world.run_until(Micros{5'000'000});
  changes = station.core().schemes_felt().changes;
  return station.core().haptic().counts().hand_over_step_max_n;
}

}  // namespace

TEST_CASE("A hand that leaves the scheme to the server gets hyper while that fits, port while it does not, and hyper again") {
  const Scene scene = scene_of("touch-cube.json");
  World world(scene,
              charged([](Micros t) { return t > Micros{2'000'000} && t < Micros{3'000'000} ? kCostlyPatch : kCheapPatch; }));
  WorldStation& station = world.add_station(hand(0, std::nullopt), std::make_unique<ReplayDevice>(press(0, 40)), near_by());
  const ClientCore& core = station.core();
  world.run_until(Micros{1'900'000});
  CHECK(core.in_use().scheme == Scheme::hyper);
  CHECK(core.in_use().reason == SchemeReason::fits);
  CHECK(core.last_patch().scheme == Scheme::hyper);
  CHECK(core.in_use().limit == Micros{42'500});  // 0.95 * 50 - 5 ms
  CHECK(std::abs((core.in_use().cost - kCheapPatch).count()) < 1'000);
  world.run_until(Micros{2'900'000});
  CHECK(core.in_use().scheme == Scheme::port);
  CHECK(core.in_use().reason == SchemeReason::server_busy);
  CHECK(core.last_patch().scheme == Scheme::port);
  CHECK(world.server().counts().frames_busy < 10);
  world.run_until(Micros{30'000'000});
  CHECK(core.in_use().scheme == Scheme::hyper);
  CHECK(core.last_patch().scheme == Scheme::hyper);
  CHECK(core.schemes_felt().changes <= 4);
}

TEST_CASE("The change from one scheme to the other is felt no more than the change from one patch to the next") {
  std::uint64_t changes = 0;
  const double with_port = hand_over_step_n(Scheme::port, changes), with_hyper = hand_over_step_n(Scheme::hyper, changes);
  const double with_both = hand_over_step_n(std::nullopt, changes);
  CHECK(changes >= 1);
  INFO(with_port << " " << with_hyper << " " << with_both);
  CHECK(with_both <= 1.2 * std::max(with_port, with_hyper));
}

TEST_CASE(
    "A room whose hands ask for more than it has time for keeps its rate, their patches by turns, and all of them where they "
    "leave "
    "it to the server") {
  const Scene scene = scene_of("touch-cube.json");
  struct Served {
    std::uint64_t frames = 0, patches = 0;
  };
  const auto served = [&](SchemeAsked asked) {
    World world(scene, charged([](Micros) { return Micros{15'000}; }));
    for (int k = 0; k < 4; ++k) world.add_station(hand(k, asked), std::make_unique<ReplayDevice>(press(k, 6)), near_by());
    world.run_until(Micros{5'000'000});
    Served all{world.server().counts().frames, 0};
    for (std::size_t k = 0; k < 4; ++k) all.patches += world.station(k).core().counts().patches;
    return all;
  };
  // 20 frames a second for 5 s, into which four patches of 15 ms do not fit.
  const Served dear = served(Scheme::hyper), chosen = served(std::nullopt);
  CAPTURE(dear.patches, chosen.patches);
  CHECK(dear.frames >= 95);
  CHECK(chosen.frames >= 95);
  CHECK(4 * dear.patches < 3 * chosen.patches);
}

TEST_CASE("A link that loses more than a tenth gets port") {
  const Scene scene = scene_of("touch-cube.json");
  World world(scene, charged([](Micros) { return kCheapPatch; }));
  LinkSpec bad = near_by();
  bad.loss = 0.25;
  WorldStation& station = world.add_station(hand(0, std::nullopt), std::make_unique<ReplayDevice>(press(0, 6)), bad);
  world.run_until(Micros{5'000'000});
  CHECK(station.core().in_use().scheme == Scheme::port);
  CHECK(station.core().in_use().reason == SchemeReason::link_lossy);
}

TEST_CASE("A nonlinear patch that never fits is tried ever more rarely") {
  const Scene scene = scene_of("touch-cube.json");
  World world(scene, charged([](Micros) { return kCostlyPatch; }));
  WorldStation& station = world.add_station(hand(0, std::nullopt), std::make_unique<ReplayDevice>(press(0, 70)), near_by());
  world.run_until(Micros{60'000'000});
  CHECK(station.core().schemes_felt().changes <= 8);
  CHECK(world.server().counts().frames_busy < 25);
}

TEST_CASE("A room that has time for nonlinear patches and not for rollouts leaves the rollouts out and keeps scheme and rate") {
  const Scene scene = scene_of("touch-cube.json");
  World world(scene, charged([](Micros) { return Micros{20'000}; }, Micros{30'000}));
  WorldStation& station = world.add_station(hand(0, std::nullopt), std::make_unique<ReplayDevice>(press(0, 6)), near_by());
  world.run_until(Micros{5'000'000});
  CHECK(station.core().in_use().scheme == Scheme::hyper);
  CHECK(station.core().in_use().reason == SchemeReason::fits_without_rollouts);
  CHECK(station.core().schemes_felt().changes == 0);
  CHECK(world.server().counts().frames_without_rollouts > 40);
  CHECK(world.server().counts().frames_busy <= 4);
}
