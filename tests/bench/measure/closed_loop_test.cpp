// A device in the loop: against a mass on a spring, by its energies, and run twice.
#include "bench/measure/closed_loop.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "bench/measure/gestures.hpp"
#include "bench/measure/release.hpp"
#include "common/base/error.hpp"
#include "common/base/rotation_vector.hpp"
#include "server/scene/tools.hpp"

using namespace palpate;

namespace {

const std::string kLoopSource = PALPATE_SOURCE_DIR;
constexpr double kMassKg = 0.075, kLoopTickS = 1e-3, kSpringNM = 200;

Scene cube6() { return load_scene(kLoopSource + "/scenes/cube6.json"); }

/// One spring from the ground up to the tool, for which `tangent` is exact.
Scene one_spring() {
  Scene scene;
  scene.name = "spring";
  scene.body.nodes = {Vec3::Zero(), Vec3(0, 0, 0.1)};
  scene.body.masses_kg = {0.01, 0.01};
  scene.body.fixed = {1, 0};
  scene.body.elements = {{0, 1, 0.1, kSpringNM, 0}};
  scene.tool.contact = ContactKind::attach;
  scene.tool.node = 1;
  return scene;
}

ReleaseOptions options_for(Scheme scheme, int round_trip_ms) {
  ReleaseOptions options;
  options.scheme = scheme;
  options.link.latency = Micros{500 * round_trip_ms};
  options.observe_s = 1.2;
  return options;
}

}  // namespace

TEST_CASE("A device on one spring moves as the mass under a sampled spring that it is, and its energies add up") {
  const Vec3 top(0, 0, 0.1);
  ClosedLoopOptions options;
  options.scheme = Scheme::tangent;
  options.duration = Micros{1'000'000};
  const Motion press({{0.0, top}, {0.3, top - Vec3(0, 0, 0.005)}, {1.0, top - Vec3(0, 0, 0.005)}});
  LoopHand hand{press, {}, {}};
  hand.device.tremor_m = hand.device.position_step_m = hand.device.force_step_n = 0;
  hand.device.release_s = 0.4;
  const ClosedLoopResult result = closed_loop(one_spring(), std::span(&hand, 1), options).front();
  REQUIRE(result.ticks.size() == 1001);
  constexpr std::size_t kFrom = 400;
  // x+ = x + dt v + dt^2/(2 m) F,  v+ = v + dt/m F,  F = -k x, held for a tick, so that its energy grows by the determinant 1 + k
  // dt^2/(2 m) per tick.
  double x = result.ticks[kFrom].position.z() - top.z(), v = result.ticks[kFrom].velocity.z();
  CHECK(x < -0.0015);
  const double held_j = result.ticks[kFrom].kinetic_j + result.ticks[kFrom].display_j;
  const auto store = [&](double at, double speed) {
    // The quadratic form that one tick multiplies by that determinant.
    return 0.5 * kMassKg * speed * speed - 0.25 * kSpringNM * kLoopTickS * at * speed + 0.5 * kSpringNM * at * at;
  };
  const double stored = store(x, v);
  for (std::size_t i = kFrom + 1; i < result.ticks.size(); ++i) {
    const double force = -kSpringNM * x;
    x += kLoopTickS * v + 0.5 * kLoopTickS * kLoopTickS / kMassKg * force;
    v += kLoopTickS / kMassKg * force;
    const LoopTick& tick = result.ticks[i];
    REQUIRE(std::abs(tick.position.z() - top.z() - x) < 1e-9);
    REQUIRE(std::abs(tick.velocity.z() - v) < 1e-7);
    REQUIRE(std::abs(tick.force.z() + kSpringNM * x) < 1e-6);
    REQUIRE(std::abs(tick.kinetic_j + tick.display_j - held_j) < 1e-12);
  }
  CHECK(store(x, v) / stored == Approx(std::pow(1 + kSpringNM * kLoopTickS * kLoopTickS / (2 * kMassKg), 600)).epsilon(1e-6));
  // Up to the first turning point the display has returned the energy that the spring then holds.
  CHECK(result.ticks[kFrom].display_j ==
        Approx(0.5 * kSpringNM * std::pow(result.ticks[kFrom].position.z() - top.z(), 2)).epsilon(0.02));
}

TEST_CASE("A released device and its display keep their energy between them, whatever the scheme does") {
  for (const Scheme scheme : {Scheme::hold, Scheme::ring, Scheme::port}) {
    const ReleaseResult r = release(cube6(), options_for(scheme, 50));
    for (std::size_t i = 500; i < r.loop.ticks.size(); ++i)
      REQUIRE(std::abs(r.loop.ticks[i].kinetic_j + r.loop.ticks[i].display_j - r.released_j) < 1e-12);
    if (scheme == Scheme::hold) CHECK(r.display_min_j < -0.1);
    if (scheme == Scheme::port) CHECK(r.display_min_j == 0);
  }
}

TEST_CASE("Held forces throw the device away, a patch of the whole body brings it to rest") {
  for (const int round_trip_ms : {0, 100}) {
    const ReleaseResult hold = release(cube6(), options_for(Scheme::hold, round_trip_ms));
    CHECK_FALSE(hold.verdict.stable);
    CHECK(hold.verdict.peak_to_peak_m.back() > 0.1);
    const ReleaseResult port = release(cube6(), options_for(Scheme::port, round_trip_ms));
    CHECK(port.verdict.stable);
    CHECK(port.depth_m > 0.003);
    const auto& p = port.verdict.peak_to_peak_m;
    REQUIRE(p.size() == 4);
    for (std::size_t k = 1; k < p.size(); ++k) CHECK(p[k] < 0.6 * p[k - 1]);
    CHECK(p.back() < 0.001);
  }
}

TEST_CASE("With the paper's local model a grip that only loosens is at rest, where held forces swing ever further") {
  ReleaseOptions options = options_for(Scheme::ring, 0);
  options.hand_after = *hand_from_name("light");
  CHECK(release(cube6(), options).verdict.stable);
  options.scheme = Scheme::hold;
  const ReleaseResult hold = release(cube6(), options);
  CHECK_FALSE(hold.verdict.stable);
  CHECK(hold.verdict.growth_1_s > 1);
}

TEST_CASE("Port comes to rest over a second of delay at 10 Hz") {
  ReleaseOptions options = options_for(Scheme::port, 1000);
  options.rate_hz = 10;
  options.observe_s = 0;
  const ReleaseResult r = release(cube6(), options);
  CHECK(r.verdict.stable);
  CHECK(r.verdict.growth_1_s < -1);
}

TEST_CASE("A run ends at its time also where frames do not fall on whole milliseconds") {
  ReleaseOptions options = options_for(Scheme::tangent, 0);
  options.rate_hz = 60;
  options.observe_s = 0.3;
  CHECK(release(cube6(), options).loop.ticks.size() == Approx(801).margin(1));
}

TEST_CASE("The guard that only observes changes nothing, and sees that held forces generate energy") {
  ReleaseOptions options = options_for(Scheme::hold, 100);
  const ReleaseResult off = release(cube6(), options);
  options.passivity = PassivityMode::observe;
  const ReleaseResult observed = release(cube6(), options);
  REQUIRE(off.loop.ticks.size() == observed.loop.ticks.size());
  CHECK(off.loop.ticks.back().position == observed.loop.ticks.back().position);
  CHECK(off.loop.guard.energy_min_j == 0);
  CHECK(observed.loop.guard.energy_min_j < -0.01);
}

TEST_CASE("A run repeated is the same to the last bit") {
  ReleaseOptions options = options_for(Scheme::port, 60);
  options.link.jitter = Micros{10'000};
  options.link.loss = 0.05;
  options.tremor_m = 1e-4;
  const ReleaseResult one = release(cube6(), options), two = release(cube6(), options);
  REQUIRE(one.loop.ticks.size() == two.loop.ticks.size());
  for (std::size_t i = 0; i < one.loop.ticks.size(); ++i) {
    REQUIRE(one.loop.ticks[i].position == two.loop.ticks[i].position);
    REQUIRE(one.loop.ticks[i].force == two.loop.ticks[i].force);
    REQUIRE(one.loop.ticks[i].display_j == two.loop.ticks[i].display_j);
  }
}

TEST_CASE("A body that is touched cannot be let go of") {
  CHECK_THROWS_AS(release(load_scene(kLoopSource + "/scenes/touch-cube.json"), ReleaseOptions{}), InputError);
}

TEST_CASE("A device that turns and its display keep their energy between them when the hand lets go of a tool on a body") {
  Scene scene = load_scene(kLoopSource + "/scenes/touch-cube.json");
  scene.tool.shape = find_tool("shaft")->shape;
  const GesturePlan plan = plan_gesture(scene, Gesture::rock, 0.01);
  LoopHand hand{plan.intention, {}, {}};
  hand.device.tremor_m = hand.device.position_step_m = hand.device.force_step_n = 0;
  hand.device.wrist = SimWrist{.torque_step_nm = 0};
  hand.device.release_s = 0.55;  // while it is tilted
  ClosedLoopOptions options;
  options.duration = Micros{800'000};
  for (const bool full_model : {true, false}) {
    const auto loops = full_model ? reference_loop(scene, std::span(&hand, 1), options.duration)
                                  : closed_loop(scene, std::span(&hand, 1), options);
    const std::vector<LoopTick>& ticks = loops.front().ticks;
    constexpr std::size_t kFrom = 551;
    REQUIRE(ticks.size() > 700);
    double spin_most = 0, torque_most_nm = 0;
    for (std::size_t i = kFrom; i < ticks.size(); ++i) {
      torque_most_nm = std::max(torque_most_nm, ticks[i].torque.norm());
      spin_most = std::max(spin_most, rotation_between(ticks[i - 1].turn, ticks[i].turn).norm() / kLoopTickS);
      REQUIRE(std::abs(ticks[i].kinetic_j + ticks[i].display_j - ticks[kFrom].kinetic_j - ticks[kFrom].display_j) < 1e-6);
    }
    CHECK(torque_most_nm > 2e-4);
    CHECK(spin_most > 0.1);
    CHECK(std::abs(ticks[kFrom].display_j - ticks.back().display_j) > 1e-4);
  }
}
