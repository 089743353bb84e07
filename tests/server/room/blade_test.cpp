// A blade that cuts while the room runs: energy and momentum where cells part, the work of the hand, other hands, loose pieces.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <numeric>

#include "common/player/player.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/room/room.hpp"
#include "server/room/stepped_body.hpp"
#include "server/scene/surface.hpp"

using namespace palpate;

namespace {

constexpr double kBladeJ = 30, kEdgeM = 0.04, kBladeTopM = 0.04, kSpeedMS = 0.02, kQuarter = 1.5707963267948966;

Scene blade_block(double spacing_m, const std::string& element = "hexahedron", const std::string& more = "") {
  const auto nodes = [&](double extent_m) { return 1 + static_cast<int>(std::lround(extent_m / spacing_m)); };
  return read_scene(
      fmt::format(R"({{"body": {{"lattice": {{"nodes": [{}, {}, {}], "size_m": [0.06, 0.06, 0.04], "fixed_faces": ["z-"],
      "solid": {{"element": "{}", "young_pa": 20000, "poisson": 0.45, "law": "neo-hookean", "damping_s": 0.01{}}}}},
      "tissue": [{{"toughness_j_m2": 30, "puncture_n": 0.5}}]}},
      "tool": {{"contact": "touch", "radius_m": 0.02, "blade": {{"length_m": 0.036, "width_m": 0.04}}}}}})",
                  nodes(0.06), nodes(0.06), nodes(kBladeTopM), element, more),
      "block");
}

/// A body and hands that move along paths of their own.
struct BladeRoom {
  explicit BladeRoom(const Scene& scene) : body(scene) { body.start(now); }
  using Path = std::function<ToolPose(double)>;
  SteppedBody body;
  std::vector<Path> hands;
  std::vector<std::uint8_t> held = {};  ///< numbers of their tools in the scene; empty: the first
  Micros begin{7'000'000}, now = begin;

  void frame(Micros length = Micros{10'000}) {
    FrameJob job;
    job.target = now + length;
    job.may_sleep = false;
    for (std::size_t k = 0; k < hands.size(); ++k) {
      StationJob hand;
      hand.id = static_cast<StationId>(k + 1);
      hand.held = held.empty() ? 0 : held[k];
      for (Micros t = now; t <= job.target + kTick; t += kTick) {
        const ToolPose pose = hands[k](seconds(t - begin));
        hand.samples.push_back({t, pose.position, pose.turn, pose.opening});
      }
      job.stations.push_back(hand);
    }
    now = job.target;
    const auto report = body.step(job);
    REQUIRE(report);
    REQUIRE(report->converged);
  }
  Vec3 force(StationId id) const {
    Vec3 sum = Vec3::Zero();
    for (const std::size_t k : body.ports_of(id))
      if (body.ports()[k].touching) sum -= body.ports()[k].lambda;
    return sum;
  }
  const NeedleTip& tip() const { return body.ports()[body.ports_of(1).front()].needle.tip; }
};

/// Down along z with its edge along y.
BladeRoom::Path stab(double x_m, double y_m, double deepest_m) {
  return [=](double s) {
    return ToolPose(Vec3(x_m, y_m, kBladeTopM + 0.001 - std::min(kSpeedMS * s, 0.001 + deepest_m)),
                    Rotation(Eigen::AngleAxisd(kQuarter, Vec3::UnitZ())));
  };
}

}  // namespace

TEST_CASE("Where a blade parts cells, their copies begin with the motion and the acceleration of what they were", "[blade]") {
  const std::string element = GENERATE("hexahedron", "tetrahedron");
  CAPTURE(element);
  BladeRoom room(blade_block(0.01, element, R"(, "relaxation": [{"share": 0.3, "time_s": 0.2}])"));
  room.hands = {stab(0.0312, 0.029, 0.03)};
  const double mass = room.body.dynamics().masses().sum();
  int splits = 0;
  for (int k = 0; k < 160; ++k) {
    room.frame();
    const auto& parted = room.body.parted();
    const SteppedBody& body = room.body;
    CHECK(body.dynamics().masses().sum() == Approx(mass).epsilon(1e-12));
    if (!parted) continue;
    ++splits;
    CHECK(parted->loose == 0);
    CHECK(check_edges(body.scene().body.triangles).closed());
    Vector load;
    body.dynamics().forces(body.state(), load);
    for (const ToolPort& port : body.ports())
      if (port.touching) scatter(weights_of(body.skin(), port), port.lambda, load);
    std::map<std::uint32_t, std::uint32_t> first;
    Vec3 traction = Vec3::Zero();
    double largest = 0, off = 0, moved = 0;
    for (std::uint32_t i = 0; i < body.dynamics().nodes(); ++i) {
      const std::uint32_t j = first.try_emplace(parted->node_before[i], i).first->second;
      if (body.scene().body.fixed[i] != 0) continue;
      const auto acceleration = [&](std::uint32_t node) {
        return Vec3(at_node(load, node) / body.dynamics().masses()[3 * node]);
      };
      moved = std::max({moved, (at_node(body.state().x, i) - at_node(body.state().x, j)).norm(),
                        (at_node(body.state().v, i) - at_node(body.state().v, j)).norm()});
      largest = std::max(largest, acceleration(i).norm());
      off = std::max(off, (acceleration(i) - acceleration(j)).norm());
      traction += at_node(body.state().traction->load, i);
    }
    CHECK(moved == 0);
    CHECK(off <= 1e-9 * largest);
    CHECK(traction.norm() <= 1e-9 * body.state().traction->load.norm() + 1e-15);
  }
  CHECK(splits >= 2);
  CHECK(room.body.dynamics().nodes() > room.body.begun().nodes.size());
}

TEST_CASE("A hand that holds the tissue beside a blade feels no step where cells part", "[blade]") {
  BladeRoom room(blade_block(0.01));
  const auto hold = [](double) { return Vec3(0.044, 0.03, kBladeTopM - 0.0015); };
  room.hands = {stab(0.0312, 0.029, 0.03), hold};
  std::vector<double> held;
  std::uint32_t epochs = 0;
  double most_n = 0;
  for (int k = 0; k < 160; ++k) {
    room.frame();
    held.push_back(room.force(2).z());
    epochs = room.body.epoch();
    if (held.size() > 2 && epochs > 0) most_n = std::max(most_n, std::abs(held[held.size() - 1] - held[held.size() - 3]));
  }
  CHECK(epochs >= 2);
  CHECK(held.back() > 0.05);
  CHECK(most_n < 0.01);  // 0.025 where the traction is let go at once
}

TEST_CASE("Scissors that close cut as a blade does that goes the way of their crossing, and their hand bears the same",
          "[blade]") {
  constexpr double kStrokeM = 0x1p-5;
  Scene scene = blade_block(0.01);
  BladeRoom blade(scene);
  scene.tool.needle->stroke_m = kStrokeM;
  BladeRoom scissors(scene);
  const BladeRoom::Path way = stab(0.0312, 0.029, 0.03);
  blade.hands = {way};
  // The hand goes the last millimetre before the blades close, and rests until the crossing is at their tips.
  scissors.hands = {[=](double s) {
    ToolPose pose = way(s);
    const double tips_m = kBladeTopM - 0.03, crossing_m = pose.position.z();
    pose.opening = std::min(1.0, (crossing_m - tips_m) / kStrokeM);
    pose.position.z() = crossing_m - pose.opening * kStrokeM;
    return pose;
  }};
  double most_n = 0;
  for (int k = 0; k < 160; ++k) {
    blade.frame();
    scissors.frame();
    most_n = std::max(most_n, blade.force(1).norm());
    CHECK((blade.force(1) - scissors.force(1)).norm() < 1e-6);
  }
  CHECK(most_n > 0.5);
  CHECK(scissors.tip().front_m == Approx(blade.tip().front_m).epsilon(1e-6));
  CHECK(scissors.tip().front_m > 0.02);
  CHECK(scissors.body.epoch() == blade.body.epoch());
  CHECK(scissors.body.epoch() >= 2);
  const Wrench wrench = wrench_of(scissors.body.ports().front(), {{}, Rotation::Identity(), Vec3::Zero(), 1}, Vec3::Zero());
  CHECK((wrench.torque - Vec3(0, 0, kStrokeM).cross(wrench.force)).norm() < 1e-12 * kStrokeM * wrench.force.norm());
}

TEST_CASE("A tool beside a blade feels the same whether it meets the blade's own skin or a copy of nearly that radius",
          "[blade]") {
  constexpr double kHardlyLess = 1 - 1e-9;
  const auto hold = [](double s) { return Vec3(0.044, 0.03 + 0.003 * std::sin(4 * s), kBladeTopM - 0.0015); };
  std::deque<BladeRoom> rooms;  // not movable
  for (const double share : {1.0, kHardlyLess}) {
    Scene scene = blade_block(0.01);
    scene.tools = {{.radius_m = share * scene.tool.radius_m, .name = "ball"}};
    scene.tools[0].shape = {{Vec3(0, 0, 0.006), 0.006}};
    BladeRoom& room = rooms.emplace_back(scene);
    room.held = {0, 1};
    room.hands = {stab(0.0312, 0.029, 0.03), hold};
  }
  CHECK(rooms[0].body.skin().view().triangles.size() * 2 == rooms[1].body.skin().view().triangles.size());
  for (int k = 0; k < 160; ++k) {
    for (BladeRoom& room : rooms) room.frame();
    CHECK((rooms[0].force(2) - rooms[1].force(2)).norm() < 1e-4 * std::max(rooms[0].force(2).norm(), 0.1));
  }
  CHECK(rooms[1].body.epoch() >= 2);
  CHECK(rooms[0].force(2).z() > 0.05);
}

TEST_CASE("A piece that a blade cuts off is left out, and a reset makes the body whole", "[blade]") {
  const Scene scene = read_scene(R"({"body": {"lattice": {"nodes": [7, 4, 4], "size_m": [0.06, 0.03, 0.03], "fixed_faces": ["x-"],
      "solid": {"element": "hexahedron", "young_pa": 30000, "poisson": 0.4, "damping_s": 0.02}},
      "tissue": [{"toughness_j_m2": 10, "puncture_n": 0.1}]},
      "tool": {"contact": "touch", "radius_m": 0.02, "blade": {"length_m": 0.05, "width_m": 0.04}}})",
                                 "beam");
  BladeRoom room(scene);
  room.hands = {[](double s) {
    return ToolPose(Vec3(0.0245, 0.0151, 0.031 - std::min(0.03 * s, 0.046)),
                    Rotation(Eigen::AngleAxisd(kQuarter, Vec3::UnitZ())));
  }};
  const double mass = room.body.dynamics().masses().sum();
  std::size_t loose = 0;
  for (int k = 0; k < 180 && loose == 0; ++k) {
    room.frame();
    if (room.body.parted()) loose += room.body.parted()->loose;
  }
  CHECK(loose == 3 * 3 * 3 + 3 * 3);
  CHECK(room.body.dynamics().masses().sum() == Approx(mass * 0.0245 / 0.06).epsilon(0.03));
  for (int k = 0; k < 20; ++k) room.frame();
  CHECK(room.body.state().x.allFinite());
  FrameJob job;
  job.target = room.now + Micros{50'000};
  job.reset = true;
  room.body.step(job);
  CHECK(room.body.dynamics().masses().sum() == mass);
  CHECK((room.body.state().x - room.body.rest().x).norm() < 1e-9);
}

TEST_CASE("A player with the patches of a blade feels what it does while cells part", "[blade]") {
  const Scheme scheme = GENERATE(Scheme::port, Scheme::hyper);
  CAPTURE(scheme);
  const Scene scene = blade_block(0.01);
  Room room(scene);
  Micros now{7'000'000};
  const Micros begin = now;
  room.start(now);
  const BladeRoom::Path path = stab(0.0312, 0.029, 0.03);
  std::optional<PatchPlayer> player;
  double error_n = 0, peak_n = 0;
  std::size_t vertices = 0;
  for (int k = 0; k < 36; ++k) {
    FrameJob job;
    job.target = now + Micros{50'000};
    job.shapes = true;
    StationJob hand;
    hand.id = 1;
    hand.scheme = scheme;
    hand.horizon = Micros{100'000};
    for (Micros t = now + kTick; t <= job.target + kTick; t += kTick) {
      const ToolPose pose = path(seconds(t - begin));
      hand.samples.push_back({t, pose.position, pose.turn});
    }
    job.stations.push_back(hand);
    now = job.target;
    const FrameResult result = room.run(job);
    REQUIRE_FALSE(result.failed);
    const StationFrame& frame = result.stations.front();
    vertices = result.positions.size();
    if (player) {
      for (Micros t = player->time() + kTick; t <= now; t += kTick) {
        const ToolPose pose = path(seconds(t - begin));
        player->advance({t, pose.position, pose.turn});
      }
      error_n = std::max(error_n, (player->output().force - frame.force).norm());
      peak_n = std::max(peak_n, frame.force.norm());
    }
    player.reset();
    if (!frame.patch) continue;
    REQUIRE(check(*frame.patch) == PatchFault::none);
    player.emplace(*frame.patch, frame.terms);
  }
  REQUIRE(peak_n > 0.5);
  CHECK(error_n < 0.1 * peak_n);
  CHECK(vertices > scene.body.nodes.size());
}

TEST_CASE("The cut of the scene's blade opens by the body's weight when the blade has left", "[blade]") {
  BladeRoom room(load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/cuts/blade.json"));
  static constexpr double kTop = 0.064, kPlaneM = 0.002;
  room.hands = {[](double s) {
    const double in_m = 0.03 * (s < 1.4 ? s : 2.8 - s) - 0.005;
    return ToolPose(Vec3(0.001, kPlaneM, kTop - in_m));
  }};
  double most_n = 0;
  for (int k = 0; k < 100; ++k) {
    room.frame(Micros{30'000});
    most_n = std::max(most_n, room.force(1).z());
  }
  CHECK(most_n > 1.1);
  CHECK_FALSE(room.tip().inside);
  const LumpedBody& body = room.body.scene().body;
  double open_m = 0, overlap_m = 0;
  for (std::uint32_t a = 0; a < body.nodes.size(); ++a)
    for (std::uint32_t b = 0; b < a; ++b) {
      if (body.nodes[a] != body.nodes[b]) continue;
      // The earlier of the two is the scene's node, on its own side; the other goes with the side across.
      const double apart_m = at_node(room.body.state().x, a).y() - at_node(room.body.state().x, b).y();
      const double opens_m = body.nodes[b].y() < kPlaneM ? apart_m : -apart_m;
      open_m = std::max(open_m, opens_m);
      overlap_m = std::max(overlap_m, -opens_m);
    }
  CHECK(open_m > 1e-3);
  CHECK(open_m > 4 * overlap_m);
}
