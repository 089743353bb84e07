// The simulated world: joining, clocks, patches over bad links, several stations, repeatability.
#include "bench/world/world.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

Scene world_cube6() { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cube6.json"); }

ClientOptions named(const std::string& name, Scheme scheme = Scheme::port) {
  ClientOptions options;
  options.hello.station = name;
  options.hello.scheme = scheme;
  return options;
}
std::unique_ptr<MotionDevice> sway(const Vec3& home) {
  std::vector<MotionPoint> points;
  for (int i = 0; i <= 4000; ++i)
    points.push_back({i * 1e-3, home + Vec3(0.003 * std::sin(i * 0.006), 0, -0.004 * (1 - std::cos(i * 0.01)))});
  return std::make_unique<ReplayDevice>(Motion(std::move(points)));
}
LinkSpec delayed(int one_way_ms, double loss = 0, int jitter_ms = 0) {
  LinkSpec link;
  link.latency = Micros{1000 * one_way_ms};
  link.jitter = Micros{1000 * jitter_ms};
  link.loss = loss;
  return link;
}

}  // namespace

TEST_CASE("A station joins over a bad link and gets a patch for every frame that it could, none of them from the future") {
  const Scene scene = world_cube6();
  World world(scene, {});
  WorldStation& station = world.add_station(named("hand"), sway(home_of(scene)), delayed(30, 0.1, 5));
  Micros newest_age{0}, oldest_age{0};
  int ticks = 0;
  station.on_tick = [&](Micros t, const Vec3&, const TickOutput& out) {
    ++ticks;
    if (t < Micros{1'500'000}) return;
    CHECK(out.has_patch);
    newest_age = newest_age == Micros{0} ? out.patch_age : std::min(newest_age, out.patch_age);
    oldest_age = std::max(oldest_age, out.patch_age);
  };
  world.run_until(Micros{3'000'000});
  CHECK(station.core().link() == LinkState::joined);
  CHECK(world.now() == Micros{3'000'000});
  CHECK(ticks >= 3000);
  CHECK(newest_age >= Micros{50'000});
  CHECK(oldest_age < Micros{400'000});
  CHECK(station.core().haptic().counts().patches_used > 35);
  CHECK(station.core().intake_counts().from_future == 0);
}

TEST_CASE(
    "Two stations feel the same as each would with the other's link still the same, and one that is named twice is refused") {
  const Scene scene = world_cube6();
  World world(scene, {});
  WorldStation& first = world.add_station(named("hand"), sway(home_of(scene)), delayed(5));
  world.run_until(Micros{500'000});
  WorldStation& twin = world.add_station(named("hand"), sway(home_of(scene)), delayed(5));
  world.run_until(Micros{1'500'000});
  CHECK(first.core().link() == LinkState::joined);
  CHECK(twin.core().link() == LinkState::refused);
  CHECK_FALSE(twin.core().refusal().empty());
}

TEST_CASE("Clock offsets do not matter: other seeds of them give the same force to the last few bits") {
  const Scene scene = world_cube6();
  const auto felt = [&](std::uint64_t seed) {
    WorldOptions options;
    options.seed = seed;
    World world(scene, options);
    WorldStation& station = world.add_station(named("hand"), sway(home_of(scene)), delayed(20));
    std::vector<Vec3> forces;
    station.on_tick = [&](Micros, const Vec3&, const TickOutput& out) { forces.push_back(out.force); };
    world.run_until(Micros{1'500'000});
    return forces;
  };
  const auto a = felt(1), again = felt(1), other = felt(9);
  REQUIRE(a.size() == other.size());
  CHECK(a == again);
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] - other[i]).norm());
  CHECK(worst < 1e-3);
  CHECK(a.back().norm() > 0.05);
}

TEST_CASE("A frame that takes the server 30 ms makes its patches 30 ms older") {
  const Scene scene = world_cube6();
  const auto mean_age_ms = [&](Micros compute) {
    WorldOptions options;
    options.compute = compute;
    World world(scene, options);
    WorldStation& station = world.add_station(named("hand"), sway(home_of(scene)), delayed(10));
    double sum = 0;
    int count = 0;
    station.on_tick = [&](Micros t, const Vec3&, const TickOutput& out) {
      if (t < Micros{1'000'000}) return;
      sum += 1e3 * seconds(out.patch_age);
      ++count;
    };
    world.run_until(Micros{2'000'000});
    return sum / count;
  };
  CHECK(mean_age_ms(Micros{30'000}) - mean_age_ms(Micros{0}) == Approx(30).margin(3));
}
