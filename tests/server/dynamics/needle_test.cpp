#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "common/base/random.hpp"
#include "server/body/settle.hpp"
#include "server/dynamics/integrator.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/scene/scene.hpp"

namespace palpate {
namespace {

constexpr double kToughness = 164, kDiameterM = 0.00127, kTopM = 0.048;

Scene block(double spacing_m, double friction_n_m, double puncture_n = 0.6) {
  const auto nodes = [&](double extent_m) { return std::to_string(1 + static_cast<int>(std::lround(extent_m / spacing_m))); };
  const std::string text = R"({"body": {"lattice": {"nodes": [)" + nodes(0.06) + "," + nodes(0.06) + "," + nodes(kTopM) +
                           R"(], "size_m": [0.06, 0.06, 0.048], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 8000, "poisson": 0.45, "law": "neo-hookean", "damping_s": 0.01}},
      "tissue": [{"toughness_j_m2": 164, "puncture_n": )" +
                           std::to_string(puncture_n) + R"(, "friction_n_m": )" + std::to_string(friction_n_m) + R"(}]},
      "tool": {"contact": "touch", "radius_m": 0.02, "needle": {"length_m": 0.04, "diameter_m": 0.00127}}})";
  return read_scene(text, "block");
}

struct NeedleBench {
  Scene scene;
  Skin skin{scene.body, scene.tool.radius_m};
  NeedleTissue tissue{scene, skin};
  Dynamics dynamics{scene.body};
  Integrator integrator{dynamics, skin, {.step_s = 0.005, .tolerance_m = 1e-8, .event_step_s = 0.001}};
  BodyState state = settled_state(dynamics, "block");
  std::vector<ToolPort> ports;
  double x_m = 0.031, y_m = 0.029;

  explicit NeedleBench(Scene s) : scene(std::move(s)) {
    ToolPort port;
    port.parameters = {scene.tool.contact_stiffness_n_m, scene.tool.friction};
    ports = needle_ports(port, tissue);
  }
  void move_to(double from_z_m, double to_z_m, double until_s) {
    const double begin_s = state.time_s;
    const auto tool = [&](std::size_t, double t) {
      const double part = (t - begin_s) / (until_s - begin_s);
      return ToolAt{Vec3(x_m, y_m, from_z_m + part * (to_z_m - from_z_m)), Vec3(0, 0, (to_z_m - from_z_m) / (until_s - begin_s))};
    };
    REQUIRE(integrator.advance(state, ports, until_s, tool).converged);
  }
  double force_n() const {
    double sum = 0;
    for (const ToolPort& port : ports)
      if (port.touching) sum -= port.lambda.z();
    return sum;
  }
  const NeedleTip& tip() const { return ports.front().needle.tip; }
};

constexpr double kCutN = kToughness * kDiameterM, kSpeedMS = 0.02, kFrictionNM = 4;

/// Moves at kSpeedMS, from 1 mm above the surface on, and sums up the work of the hand.
struct Insertion {
  NeedleBench bench;
  double z_m = kTopM + 0.001, work_j = 0;

  void move_by(double way_m) {
    constexpr double kFrameS = 0.01;
    for (const double begin_m = z_m; std::abs(z_m - begin_m) < std::abs(way_m) - 1e-9;) {
      const double before_n = bench.force_n(), next_m = z_m + std::copysign(kSpeedMS * kFrameS, way_m);
      bench.move_to(z_m, next_m, bench.state.time_s + kFrameS);
      work_j -= 0.5 * (before_n + bench.force_n()) * (next_m - z_m);
      z_m = next_m;
    }
  }
};

/// In, deeper, back, and out: force and work against the toughness and the friction of the tissue.
void insert_and_withdraw(double spacing_m) {
  CAPTURE(spacing_m);
  Insertion insertion{NeedleBench(block(spacing_m, kFrictionNM))};
  NeedleBench& bench = insertion.bench;
  insertion.move_by(-0.006);
  const NeedleTip before = bench.tip();
  REQUIRE(before.inside);
  const double begin_j = insertion.work_j;
  insertion.move_by(-0.016);
  const double c_m = bench.tip().front_m, friction_j = 0.5 * kFrictionNM * (c_m * c_m - before.front_m * before.front_m);
  CHECK(bench.tip().depth_m == c_m);
  // The tissue before the tip is compressed by a per cent: a cut of its length at rest takes so much more force.
  CHECK(bench.force_n() == Approx(kCutN + kFrictionNM * c_m).epsilon(0.02));
  const double toughness = (insertion.work_j - begin_j - friction_j) / (kDiameterM * (c_m - before.front_m));
  CHECK(toughness == Approx(kToughness).epsilon(0.02));
  insertion.move_by(0.008);
  CHECK(bench.tip().front_m == c_m);
  CHECK(bench.force_n() == Approx(-kFrictionNM * bench.tip().depth_m).epsilon(0.01));
  insertion.move_by(0.016);
  CHECK_FALSE(bench.tip().inside);
  CHECK(bench.force_n() == 0);
}

TEST_CASE("A needle bears the toughness times its width and the friction of its shaft, on cells of any size") {
  for (const double spacing_m : {0.012, 0.006}) insert_and_withdraw(spacing_m);
}

TEST_CASE("A needle bears the same on cells of 3 mm", "[.soak]") { insert_and_withdraw(0.003); }

TEST_CASE("A needle enters the body where it is pushed by more than the first layer bears, and no sooner") {
  constexpr double kPunctureN = 0.6;
  Insertion insertion{NeedleBench(block(0.012, 0, kPunctureN))};
  NeedleBench& bench = insertion.bench;
  double most_n = 0;
  while (!bench.tip().inside && insertion.z_m > kTopM - 0.02) {
    most_n = std::max(most_n, bench.force_n());
    insertion.move_by(-0.0002);
  }
  REQUIRE(bench.tip().inside);
  CHECK(most_n < kPunctureN);
  CHECK(most_n > 0.9 * kPunctureN);
  insertion.move_by(-0.002);
  CHECK(bench.force_n() == Approx(kCutN).epsilon(0.03));
}

TEST_CASE("A needle that is moved aside in the body is pulled back, the more the deeper it is") {
  double before_n = 0;
  for (const double depth_m : {0.006, 0.012, 0.024}) {
    Insertion insertion{NeedleBench(block(0.012, 0))};
    insertion.move_by(-depth_m);
    NeedleBench& bench = insertion.bench;
    const auto aside_n = [&] {
      double sum = 0;
      for (const ToolPort& port : bench.ports)
        if (port.touching) sum -= port.lambda.x();
      return sum;
    };
    const double at_first_n = aside_n();
    bench.x_m += 0.002;
    bench.move_to(insertion.z_m, insertion.z_m, bench.state.time_s + 0.3);
    CHECK(aside_n() - at_first_n < before_n - 0.03);
    before_n = aside_n() - at_first_n;
  }
}

TEST_CASE("A needle that jumps about in the body leaves it, and the body comes to rest") {
  Insertion insertion{NeedleBench(block(0.012, kFrictionNM))};
  insertion.move_by(-0.015);
  NeedleBench& bench = insertion.bench;
  REQUIRE(bench.tip().inside);
  bench.x_m += 0.3;
  bench.move_to(insertion.z_m, insertion.z_m, bench.state.time_s + 0.05);
  CHECK_FALSE(bench.tip().inside);
  bench.move_to(insertion.z_m, insertion.z_m, bench.state.time_s + 2);
  CHECK(bench.force_n() == 0);
  CHECK(bench.state.v.cwiseAbs().maxCoeff() < 1e-3);
}

TEST_CASE("A material point of a path moves exactly with an affine motion of the nodes") {
  const NeedleBench bench(block(0.012, 0));
  Mat3 f;
  f << 1.1, 0.2, 0, -0.1, 0.9, 0.05, 0.02, 0, 1.2;
  const Vec3 shift(0.01, -0.02, 0.03);
  Vector x(bench.state.x.size());
  for (std::uint32_t i = 0; i < bench.scene.body.nodes.size(); ++i) at_node(x, i) = f * bench.scene.body.nodes[i] + shift;
  for (const Vec3& at : {Vec3(0.03, 0.04, 0.03), Vec3(0.002, 0.001, 0.047), Vec3(0.051, 0.05, 0.011)}) {
    const NeedlePath::Point point = bench.tissue.point(at);
    CHECK((point.position(x) - (f * at + shift)).norm() < 1e-6);
  }
}

TEST_CASE("A path is straight where it begins, with points at even distances of the body at rest, through its layers") {
  Scene scene = block(0.012, 0);
  scene.body.tissue = {{0.012, 164, 0.6, 0}, {0, 225, 0.9, 0}};
  scene.tool.needle->length_m = 0.08;
  NeedleBench bench(std::move(scene));
  for (std::uint32_t i = 0; i < bench.scene.body.nodes.size(); ++i) at_node(bench.state.x, i).z() *= 0.9;
  const Vec3 way = Vec3(0.1, -0.2, -1).normalized();
  const NearestPoint top = nearest_point(bench.skin.view(), bench.skin.rest(), Vec3(0.03, 0.03, 0.06));
  const auto path = bench.tissue.path(top.point, way, Vec3::UnitX(), bench.state.x);
  const Vec3 begin = path->points.front().position(bench.state.x);
  const Vec3 at_rest = way.cwiseProduct(Vec3(1, 1, 1 / 0.9));  // d X of a way of length 1
  for (int j = 1; j < kNeedlePoints && j * 0.020 < 0.048; ++j) {
    const Vec3 at = path->points[static_cast<std::size_t>(j)].position(bench.state.x) - begin;
    CHECK(at.cross(way).norm() < 1e-5);
    CHECK(at.norm() * at_rest.norm() == Approx(j * 0.020).epsilon(1e-3));
  }
  // Layers by the distance from the surface: 12 mm, and the held face 48 mm below, at an angle.
  const double slope = at_rest.norm() / -at_rest.z();
  REQUIRE(path->layers.count == 3);
  CHECK(path->layers.of[1].begins_m == Approx(0.012 * slope).epsilon(1e-3));
  CHECK(path->layers.of[2].begins_m == Approx(0.048 * slope).epsilon(1e-3));
  CHECK(path->layers.of[2].cutting_n == 0);
  CHECK(path->layers.of[1].cutting_n == Approx(225 * kDiameterM));
}

}  // namespace
TEST_CASE("The layers of a path are in the body where it is, gap or not, for paths anyhow through an open wound") {
  // Two slanted cuts, between which a wedge falls out.
  const Scene scene =
      read_scene(R"({"body": {"lattice": {"nodes": [11, 9, 6], "size_m": [0.06, 0.048, 0.03], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 8000, "damping_s": 0.01}}, "tissue": [{"toughness_j_m2": 164, "puncture_n": 0.2}],
      "cuts": [{"path": [{"at_m": [-0.01, 0.0147, 0.04]}, {"at_m": [0.07, 0.0147, 0.04]}], "direction": [0, 1, -3], "depth_m": 0.031},
               {"path": [{"at_m": [-0.01, 0.0333, 0.04]}, {"at_m": [0.07, 0.0333, 0.04]}], "direction": [0, -1, -3], "depth_m": 0.031}]},
      "tool": {"contact": "touch", "radius_m": 0.012, "needle": {"length_m": 0.06, "diameter_m": 0.001}}})",
                 "wound");
  const Skin skin(scene.body, scene.tool.radius_m);
  const NeedleTissue tissue(scene, skin);
  const Vector x = Dynamics(scene.body).rest_state().x;
  Random random(11);
  int gaps = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Vec3 from(random.uniform(0.01, 0.05), -0.01, random.uniform(0.004, 0.028)),
        to(from.x(), 0.06, random.uniform(0.004, 0.028));
    const NearestPoint entry = skin.nearest(0, skin.rest(), from);
    const Vec3 way = (to - entry.position).normalized();
    const auto path = tissue.path(entry.point, way, Vec3::Zero(), x);
    const NeedleLayers& layers = path->layers;
    for (int j = 1; j < kNeedlePoints; ++j)  // at rest the path is straight
      REQUIRE((path->rest[static_cast<std::size_t>(j)] - entry.position - j * layers.spacing_m() * way).norm() < 1e-5);
    int wrong = 0;
    for (double depth_m = 1e-4; depth_m < layers.length_m; depth_m += 1e-4) {
      bool is_inside = false;
      for (const NeedleLayer& layer : layers.all())
        if (layer.begins_m <= depth_m) is_inside = !layer.is_outside();
      wrong += is_inside != skin.holds(path->rest_at(depth_m));
    }
    CAPTURE(trial, layers.count);
    CHECK(wrong <= layers.count);  // samples next to a border
    gaps += layers.count > 2;
  }
  CHECK(gaps > 20);
}

}  // namespace palpate
