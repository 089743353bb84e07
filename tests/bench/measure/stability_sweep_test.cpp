// A part of the stability sweep, with its scenes and points.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "bench/fidelity/reference.hpp"
#include "bench/measure/stability_plan.hpp"
#include "common/base/error.hpp"

using namespace palpate;

namespace {

Scene cube(ContactKind contact) {
  Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cube6.json");
  scene.tool.contact = contact;
  if (contact == ContactKind::touch) scene.tool.radius_m = 0.02;
  return scene;
}

StabilityResult measure(const StabilityPoint& point) {
  return measure_stability(point, stability_reference(cube(point.contact), point));
}

bool contains(const std::vector<StabilityPoint>& points, const StabilityPoint& p) {
  return std::find(points.begin(), points.end(), p) != points.end();
}

}  // namespace

TEST_CASE("A released device comes to rest with port over round trips up to 400 ms at 20 Hz and a second at 10 Hz") {
  StabilityPlan plan{{Scheme::port}, port_stiffness_n_m(cube(ContactKind::attach)), false, 1};
  const std::vector<StabilityPoint> points = stability_points(plan);
  StabilityPoint p = map_base(ContactKind::attach, plan.body_n_m);
  const StabilityReference reference = stability_reference(cube(ContactKind::attach), p);
  for (const auto& [rtt_ms, rate_hz] : {std::pair(0, 20), {50, 20}, {100, 20}, {200, 20}, {400, 20}, {1000, 10}}) {
    p.rtt_ms = rtt_ms;
    p.rate_hz = rate_hz;
    CAPTURE(rtt_ms, rate_hz);
    CHECK(contains(points, p));
    const LoopVerdict v = measure_stability(p, reference).verdict;
    CHECK(v.fault == LoopFault::none);
    CHECK(v.rest.growth_1_s < -1);
  }
}

TEST_CASE("Points drawn from the sweep are stable with port and with hyper") {
  StabilityPlan plan{{Scheme::port, Scheme::hyper}, 100, true, 7};
  std::vector<StabilityPoint> points = stability_points(plan);
  // The scattered points of a quick sweep, whose seeds continue from the plan's.
  std::erase_if(points, [&](const StabilityPoint& p) { return p.seed == plan.seed; });
  REQUIRE(points.size() >= 12);
  for (const StabilityPoint& p : points) {
    if (p.rtt_ms > 500) continue;
    CAPTURE(name_of(p.scheme), p.contact, p.hand, name_of(p.gesture), p.stiffness_n_m, p.rate_hz, p.rtt_ms, p.jitter_ms,
            p.loss_pct, p.burst, p.seed);
    CHECK(measure(p).verdict.fault == LoopFault::none);
  }
}

TEST_CASE(
    "The stiffest grasps at 10 Hz come to rest: their dampers feel the steps of the reading as they were, not how they fall") {
  StabilityPoint p = map_base(ContactKind::attach, 800);
  p.rate_hz = 10;
  p.gesture = Gesture::tap;
  const StabilityReference opened = stability_reference(cube(p.contact), p);
  CHECK(measure_stability(p, opened).verdict.fault == LoopFault::none);
  StabilityPoint lossy = p;
  lossy.rate_hz = 21;
  lossy.rtt_ms = 10;
  lossy.jitter_ms = 26;
  lossy.loss_pct = 7;
  lossy.seed = 211;
  CHECK(measure_stability(lossy, opened).verdict.fault == LoopFault::none);
  p.hand = "light";
  p.gesture = Gesture::press;
  CHECK(measure(p).verdict.fault == LoopFault::none);
}

TEST_CASE("A force that is cut because no patch came, or none yet, is a blow to the hand, not a fault of the scheme") {
  StabilityPoint p =
      GENERATE(StabilityPoint{Scheme::port, ContactKind::attach, "firm", Gesture::tap, 800, 23, 171, 17, 23, 7, 252},
               StabilityPoint{Scheme::port, ContactKind::touch, "firm", Gesture::release, 400, 14, 625, 8, 24, 8, 212});
  const StabilityReference uncut = stability_reference(cube(p.contact), p);
  const StabilityResult result = measure_stability(p, uncut);
  CHECK(result.cut_s > 0.1);
  CHECK(result.verdict.fault == LoopFault::none);
  CHECK(judge_loop(result.loops[0], uncut.loops[0], result.rest_tick).fault == LoopFault::shakes);
  const auto felt = [&](const ClosedLoopResult& loop, std::size_t k) { return loop.ticks[k].force.norm(); };
  for (std::size_t k = 0; k < result.loops[0].ticks.size(); ++k)
    if (result.loops[0].ticks[k].gain == 0) CHECK(felt(result.references[0], k) == 0);
  // A scheme that shakes by itself is not excused by it.
  p.scheme = Scheme::hold;
  p.gesture = Gesture::release;
  CHECK(measure(p).verdict.fault != LoopFault::none);
}

TEST_CASE("Two hands 30 mm apart come to rest on one body, with equal and unequal delays, and firm ones at one place") {
  std::vector<StabilityPoint> points = hands_points({{Scheme::port}, 180.1, true, 1});
  std::erase_if(points,
                [](const StabilityPoint& p) { return p.hands > 2 || (p.apart_mm != 30 && p.hand != "firm") || p.jitter_ms > 0; });
  REQUIRE(points.size() == 6);
  for (const StabilityPoint& p : points) {
    CAPTURE(p.hand, name_of(p.gesture), p.stiffness_n_m, p.rate_hz, p.rtt_ms, p.others_rtt_ms, p.apart_mm, p.jitter_ms, p.seed);
    const StabilityResult result = measure(p);
    CHECK(result.verdict.fault == LoopFault::none);
    CHECK(result.loops.size() == 2);
    CHECK(result.step_max_n > 0);
  }
}

TEST_CASE("Two light hands that tapped at one place over 300 ms come to rest") {
  const std::vector<StabilityPoint> points = hands_points({{Scheme::port}, 180.1, false, 1});
  const auto point = std::ranges::find_if(points, [](const StabilityPoint& p) {
    return p.hand == "light" && p.hands == 2 && p.apart_mm == 0 && p.rtt_ms == 300 && p.others_rtt_ms == 300;
  });
  REQUIRE(point != points.end());
  const StabilityResult result = measure(*point);
  CHECK(result.verdict.fault == LoopFault::none);
  CHECK(result.verdict.rest.tail_m() < 1e-4);
}

TEST_CASE("The plan of several hands has every point once, and all within what is swept") {
  const std::vector<StabilityPoint> points = hands_points({{Scheme::port, Scheme::hyper}, 120, false, 1});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const StabilityPoint& p = points[i];
    CHECK(is_possible(p));
    CHECK((p.hands >= 2 && p.hands <= 8 && p.apart_mm >= 0 && p.apart_mm <= kApartMostMm));
    CHECK((p.rtt_ms <= 300 && p.others_rtt_ms <= 300));
    CHECK(std::find(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, points.end(), p) == points.end());
  }
  CHECK(std::ranges::any_of(points, [](const StabilityPoint& p) { return p.rtt_ms != p.others_rtt_ms; }));
}

TEST_CASE("Held forces are unstable where their delay says so, and stable on a body soft enough for it") {
  StabilityPoint p = map_base(ContactKind::attach, 400);
  p.scheme = Scheme::hold;
  p.hand = "light";
  p.rtt_ms = 100;
  CHECK(measure(p).verdict.fault != LoopFault::none);
  p.stiffness_n_m = 20;
  p.rtt_ms = 0;
  CHECK(measure(p).verdict.fault == LoopFault::none);
}

TEST_CASE("A body scaled to a stiffness has it, pressed by 0.1 mm, and a touch has its contact in series") {
  const double wanted = GENERATE(50.0, 400.0);
  const ContactKind contact = GENERATE(ContactKind::attach, ContactKind::touch);
  const Scene scene = with_port_stiffness(cube(contact), wanted);
  CHECK(port_stiffness_n_m(scene) == Approx(wanted).epsilon(1e-6));
  const Vec3 home = contact == ContactKind::attach ? home_of(scene) : Vec3(home_of(scene) - Vec3(0, 0, 0.020));
  const ReferenceForce force = reference_force(scene, ToolPath(3000, home - Vec3(0, 0, 1e-4)));
  CHECK(force.force.back().z() == Approx(wanted * 1e-4).epsilon(0.02));
}

TEST_CASE("What is stiffer than the contact itself is refused") {
  CHECK_THROWS_AS(with_port_stiffness(cube(ContactKind::touch), 1500), InputError);
}

TEST_CASE("The plan has every point once and only possible ones") {
  const std::vector<StabilityPoint> points = stability_points({{Scheme::hold, Scheme::port, Scheme::hyper}, 120, false, 1});
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(is_possible(points[i]));
    CHECK(std::find(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, points.end(), points[i]) == points.end());
  }
  for (const char* hand : {"free", "light", "firm"})
    for (const Gesture g : {Gesture::press, Gesture::tap, Gesture::stroke, Gesture::release})
      for (const ContactKind contact : {ContactKind::attach, ContactKind::touch}) {
        StabilityPoint p = map_base(contact, 120);
        p.hand = hand;
        p.gesture = g;
        p.rtt_ms = 1000;
        CHECK(contains(points, p) == is_possible(p));
      }
}

TEST_CASE("Every tool of the sweep has the gestures that suit it, and only those") {
  StabilityPlan plan{{Scheme::hold, Scheme::port}, 100, true, 1};
  const std::vector<StabilityPoint> points = tool_points(plan);
  for (const StabilityPoint& p : points) {
    CHECK(p.scheme == Scheme::port);
    CHECK((p.tool == kNeedle) == (p.gesture == Gesture::insert || p.gesture == Gesture::withdraw));
  }
  for (const char* tool : {"ball", "shaft", "grasper", "retractor"})
    CHECK(std::ranges::any_of(points, [&](const StabilityPoint& p) { return p.tool == tool && p.gesture == Gesture::twist; }));
}
