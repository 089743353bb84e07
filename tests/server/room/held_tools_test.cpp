// Hands that hold different tools of one scene.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "server/room/room.hpp"
#include "server/room/tool_track.hpp"
#include "server/scene/tools.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr Micros kHeldFrame{50'000};

struct HandOf {
  std::uint8_t held = 0;
  std::function<Vec3(double t_s)> path;
};

/// Runs a room for a second and a half; each hand has the number of its place, from 1 on.
FrameResult felt_by(const Scene& scene, const std::vector<HandOf>& hands, Scheme scheme = Scheme::port) {
  Room room(scene);
  Micros now{7'000'000};
  const Micros begin = now;
  room.start(now);
  FrameResult result;
  for (int frame = 0; frame < 30; ++frame) {
    FrameJob job;
    job.target = now + kHeldFrame;
    for (std::size_t k = 0; k < hands.size(); ++k) {
      StationJob hand;
      hand.id = static_cast<StationId>(k + 1);
      hand.held = hands[k].held;
      hand.scheme = scheme;
      hand.horizon = Micros{100'000};
      for (Micros t = now + Micros{1000}; t <= job.target + Micros{1000}; t += Micros{1000})
        hand.samples.push_back({t, hands[k].path(seconds(t - begin))});
      job.stations.push_back(hand);
    }
    now = job.target;
    result = room.run(job);
  }
  return result;
}

std::function<Vec3(double)> pressing(const Vec3& on, double deep_m, double along_m = 0) {
  return [=](double t) {
    return Vec3(on + Vec3(along_m * std::sin(3 * t), 0, 0.005 - (0.005 + deep_m) * minimum_jerk(std::min(t / 0.5, 1.0))));
  };
}

ToolSpec point_tool() { return {.friction = 0.05, .contact_stiffness_n_m = 400, .radius_m = 0.03, .name = "point"}; }
ToolSpec ball_tool() {
  ToolSpec ball{.friction = 0.5, .contact_stiffness_n_m = 2500, .radius_m = 0.01};
  ball.shape = find_tool("ball")->shape;
  ball.name = "ball";
  return ball;
}
ToolSpec bar_tool() {
  ToolSpec bar{.friction = 0.2, .contact_stiffness_n_m = 900};
  bar.shape = {{Vec3(-0.012, 0, 0.004), 0.004}, {Vec3(0, 0, 0.004), 0.004}, {Vec3(0.012, 0, 0.004), 0.004}};
  bar.name = "bar";
  return bar;
}

/// A block of springs, its top at z = 0.06 between 0 and 0.06 m, with these tools.
Scene block_with(ToolSpec first, std::vector<ToolSpec> others = {}) {
  Scene scene = box_scene(ContactKind::touch);
  scene.tool = std::move(first);
  scene.tools = std::move(others);
  return scene;
}

const Vec3 kTop(0.03, 0.03, 0.06);

}  // namespace

TEST_CASE("A hand with any of a scene's tools feels what it feels where that is the only one, while others wait in the air") {
  const std::array tools{point_tool(), ball_tool(), bar_tool()};
  const Scene all = block_with(tools[0], {tools[1], tools[2]});
  const auto waiting = [](double) { return Vec3(0.03, 0.03, 0.3); };
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper, Scheme::ring, Scheme::tangent);
  for (std::uint8_t held = 0; held < 3; ++held) {
    CAPTURE(held, name_of(scheme));
    const HandOf hand{held, pressing(kTop, 0.006, 0.004)};
    const FrameResult with_others = felt_by(
        all, {hand, {static_cast<std::uint8_t>((held + 1) % 3), waiting}, {static_cast<std::uint8_t>((held + 2) % 3), waiting}},
        scheme);
    const FrameResult alone = felt_by(block_with(tools[held]), {{0, hand.path}}, scheme);
    const StationFrame &a = with_others.stations.front(), &b = alone.stations.front();
    REQUIRE(b.force.z() > 0.3);
    CHECK((a.force - b.force).norm() < 1e-9 * b.force.norm());
    CHECK((a.torque - b.torque).norm() < 1e-9 * std::max(b.force.norm(), 1.0));
    REQUIRE(a.patch);
    REQUIRE(b.patch);
    CHECK(a.patch->contact_stiffness_n_m == tools[held].contact_stiffness_n_m);
    CHECK(a.patch->friction == tools[held].friction);
    CHECK(a.patch->turn.has_value() == !tools[held].shape.empty());
    CHECK(a.patch->surface.vertex_count == b.patch->surface.vertex_count);
    CHECK((a.patch->surface.vertices[0].position - b.patch->surface.vertices[0].position).norm() < 1e-9);
    CHECK(a.patch->others.count == b.patch->others.count);
  }
}

TEST_CASE("The parameters and the body of a tool decide what is felt: any two of a scene's tools feel different forces") {
  const Scene all = block_with(point_tool(), {ball_tool(), bar_tool()});
  std::array<double, 3> force_n{};
  for (std::uint8_t held = 0; held < 3; ++held)
    force_n[held] = felt_by(all, {{held, pressing(kTop, 0.006)}}).stations.front().force.z();
  for (const auto& [a, b] : {std::pair(0U, 1U), {0U, 2U}, {1U, 2U}}) CHECK(std::abs(force_n[a] - force_n[b]) > 0.02 * force_n[a]);
}

TEST_CASE("A patch has the contact of another tool with the coupling and friction of that tool, unless they are its own") {
  const Vec3 beside = kTop + Vec3(0.02, 0, 0);
  const auto others = [&](const Scene& scene, std::uint8_t first, std::uint8_t second) {
    const FrameResult felt = felt_by(scene, {{first, pressing(kTop, 0.006)}, {second, pressing(beside, 0.005)}});
    REQUIRE(felt.stations.front().patch);
    const PatchOthers& all = felt.stations.front().patch->others;
    REQUIRE(all.count == 1);
    CHECK(all.of[0].touching);
    return all.of[0].law;
  };
  ToolSpec soft = point_tool();
  soft.name = "soft";
  soft.contact_stiffness_n_m = 250;
  soft.friction = 0.4;
  const Scene scene = block_with(point_tool(), {soft});
  CHECK(others(scene, 0, 1) == ContactParameters{250, 0.4});
  CHECK(others(scene, 1, 0) == ContactParameters{400, 0.05});
  CHECK_FALSE(others(scene, 0, 0));
  CHECK_FALSE(others(scene, 1, 1));
}

TEST_CASE("What two hands with different tools feel does not depend on which came first") {
  const Scene scene = block_with(point_tool(), {ball_tool()});
  const FrameResult both =
      felt_by(scene, {{0, pressing(kTop - Vec3(0.02, 0, 0), 0.005)}, {1, pressing(kTop + Vec3(0.02, 0, 0), 0.005)}});
  const FrameResult swapped =
      felt_by(scene, {{1, pressing(kTop + Vec3(0.02, 0, 0), 0.005)}, {0, pressing(kTop - Vec3(0.02, 0, 0), 0.005)}});
  for (std::size_t k = 0; k < 2; ++k) {
    REQUIRE(both.stations[k].force.z() > 0.1);
    CHECK((both.stations[k].force - swapped.stations[1 - k].force).norm() < 1e-3 * both.stations[k].force.norm());
  }
}
