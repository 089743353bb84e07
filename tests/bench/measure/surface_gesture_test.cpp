// Gestures derived from a body's own surface: the tool meets the body, whatever its shape.
#include "bench/measure/surface_gesture.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "server/body/settle.hpp"

using namespace palpate;

namespace {

/// A ring of square section around the z axis, outer radius 60 mm, inner 30 mm, 20 mm high: nothing below the middle of its top.
Scene ring() {
  constexpr int kAround = 24;
  Scene scene;
  scene.name = "ring";
  scene.tool.contact = ContactKind::touch;
  LumpedBody& body = scene.body;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    for (const auto& [radius, z] : {std::pair{0.03, 0.0}, {0.06, 0.0}, {0.06, 0.02}, {0.03, 0.02}})
      body.nodes.push_back(radius * out + Vec3(0, 0, z));
  }
  const auto node = [](int i, int corner) { return static_cast<std::uint32_t>(4 * (i % kAround) + corner % 4); };
  for (int i = 0; i < kAround; ++i)
    for (int c = 0; c < 4; ++c) {
      body.triangles.push_back({node(i, c), node(i + 1, c), node(i, c + 1)});
      body.triangles.push_back({node(i, c + 1), node(i + 1, c), node(i + 1, c + 1)});
    }
  body.fixed.assign(body.nodes.size(), 0);
  body.masses_kg.assign(body.nodes.size(), 0.001);
  // Counter-clockwise seen from outside, however they were made: the top's faces point up.
  for (Triangle& t : body.triangles) {
    const Vec3 &a = body.nodes[t[0]], &b = body.nodes[t[1]], &c = body.nodes[t[2]];
    const Vec3 middle = (a + b + c) / 3, core = 0.045 * Vec3(middle.x(), middle.y(), 0).normalized() + Vec3(0, 0, 0.01);
    if ((b - a).cross(c - a).dot(middle - core) < 0) std::swap(t[1], t[2]);
  }
  return scene;
}

Scene gesture_scene(const std::string& name) { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/" + name); }

}  // namespace

TEST_CASE("A press meets a ring, above whose middle there is nothing", "[gesture]") {
  const Motion press = surface_gesture(ring(), SurfaceGesture::press);
  double lowest = 1;
  for (const MotionPoint& p : press.points()) {
    const double radius = p.position.head<2>().norm();
    CHECK((radius > 0.03 && radius < 0.06));
    lowest = std::min(lowest, p.position.z());
  }
  CHECK(lowest == Approx(0.02 - 0.02 / 8));  // an eighth of its height deep
  CHECK(press.points().front().position.z() == Approx(0.04));
}

TEST_CASE("A press meets a body that sags in gravity where it hangs", "[gesture]") {
  const Scene scene =
      read_scene(R"({"body": {"lattice": {"nodes": [9, 3, 3], "size_m": [0.16, 0.04, 0.04], "fixed_faces": ["x-", "x+"],
      "gravity_m_s2": [0, 0, -9.81], "solid": {"young_pa": 3000}}}, "tool": {"contact": "touch"}})",
                 "beam.json");
  const Dynamics dynamics(scene.body);
  const BodyState hangs = settled_state(dynamics, "hanging");
  std::uint32_t top = 0;  // middle of the upper side
  Eigen::AlignedBox3d box;
  for (const Vec3& x : scene.body.nodes) box.extend(x);
  const Vec3 middle(box.center().x(), box.center().y(), box.max().z());
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if ((scene.body.nodes[i] - middle).norm() < (scene.body.nodes[top] - middle).norm()) top = i;
  const double rests_m = scene.body.nodes[top].z(), hangs_m = at_node(hangs.x, top).z();
  REQUIRE(rests_m - hangs_m > 0.01);
  double lowest_m = rests_m;
  const Motion press = surface_gesture(scene, SurfaceGesture::press);
  for (const MotionPoint& p : press.points()) lowest_m = std::min(lowest_m, p.position.z());
  CHECK(lowest_m < hangs_m - 0.001);
  CHECK(lowest_m > hangs_m - 0.012);
}

TEST_CASE("Every gesture begins and ends at rest, goes below the surface, and never jumps", "[gesture]") {
  for (const char* name : {"touch-cube.json", "organ.json", "cube6.json"}) {
    const Scene scene = gesture_scene(name);
    for (std::size_t k = 0; k < kSurfaceGestureNames.size(); ++k) {
      const Motion motion = surface_gesture(scene, static_cast<SurfaceGesture>(k));
      INFO(name << ", " << kSurfaceGestureNames[k]);
      const auto points = motion.points();
      CHECK((points[0].position - points[100].position).norm() == Approx(0).margin(1e-12));
      CHECK((points[points.size() - 1].position - points[points.size() - 100].position).norm() == Approx(0).margin(1e-12));
      double deepest = 0, fastest = 0;
      for (std::size_t i = 1; i < points.size(); ++i) {
        deepest = std::max(deepest, points[0].position.z() - points[i].position.z());
        fastest = std::max(fastest, (points[i].position - points[i - 1].position).norm() * 1e3);
      }
      CHECK(deepest > (scene.tool.contact == ContactKind::touch ? 0.021 : 0.003));
      CHECK(fastest < 0.5);  // m/s
    }
  }
}
