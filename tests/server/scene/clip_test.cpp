// Lattices cut to a shape: closed smooth surfaces, accurate volumes, no squashed cells.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "scene_files.hpp"
#include "server/scene/clip.hpp"
#include "server/scene/mesh_solid.hpp"

namespace palpate {
namespace {

using test::Folder;
using test::replaced;

constexpr double kPi = 3.14159265358979323846;

int euler_characteristic(const std::vector<Triangle>& triangles) {
  std::set<std::uint32_t> used;
  for (const Triangle& t : triangles) used.insert(t.begin(), t.end());
  return static_cast<int>(used.size()) - static_cast<int>(triangles.size()) / 2;  // closed: E = 3 F / 2
}

const char* const kBall = R"({"body": {"lattice": {"spacing_m": 0.01,
  "clip": {"ellipsoids": [{"center_m": [0.01, 0.02, 0.05], "radii_m": [0.06, 0.05, 0.04], "rotation_deg": [10, 20, 30]}]},
  "density_kg_m3": 1100, "stiffness_n_m": 25, "damping_n_s_m": 0.1, "fixed_faces": ["z-"]}}})";

TEST_CASE("A clipped ellipsoid has its volume and mass, and every outside node lies on it", "[scene]") {
  const auto body = load_scene(Folder().write("ball.json", kBall)).body;
  const double volume = 4 * kPi / 3 * 0.06 * 0.05 * 0.04;
  CHECK(check_edges(body.triangles).closed());
  CHECK(euler_characteristic(body.triangles) == 2);
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(volume).epsilon(0.03));
  CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) ==
        Approx(1100 * signed_volume(body.triangles, body.nodes)).epsilon(1e-12));

  const Mat3 turn = rotation_xyz(Vec3(10, 20, 30));
  for (const Triangle& t : body.triangles) {
    for (const auto i : t) {
      const Vec3 local = (turn.transpose() * (body.nodes[i] - Vec3(0.01, 0.02, 0.05))).cwiseQuotient(Vec3(0.06, 0.05, 0.04));
      CHECK(local.norm() == Approx(1).margin(1e-6));
    }
  }
}

TEST_CASE("Elements of a clipped body are never shorter than a third of the spacing and have their own rest length", "[scene]") {
  const auto body = load_scene(Folder().write("ball.json", kBall)).body;
  for (const Element& e : body.elements) {
    const double length = (body.nodes[e.a] - body.nodes[e.b]).norm();
    CHECK(length >= 0.3 * 0.01);
    CHECK(length <= 3 * 0.01);
    CHECK(e.rest_length_m == Approx(length).epsilon(1e-14));
  }
}

TEST_CASE("A fixed face of a clipped body holds the nodes within half a spacing of its lowest", "[scene]") {
  const auto body = load_scene(Folder().write("ball.json", kBall)).body;
  double low = 1;
  for (const Vec3& x : body.nodes) low = std::min(low, x[2]);
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    if (body.nodes[i][2] < low + 0.0049) CHECK(body.fixed[i]);
    if (body.nodes[i][2] > low + 0.0051) CHECK(!body.fixed[i]);
  }
  const auto planes = load_scene(Folder().write("b.json", replaced(kBall, "\"fixed_faces\": [\"z-\"]",
                                                                   "\"fixed_below_z_m\": 0.03, \"fixed_above_z_m\": 0.08")))
                          .body;
  for (std::size_t i = 0; i < planes.nodes.size(); ++i)
    CHECK((planes.fixed[i] != 0) == (planes.nodes[i][2] < 0.03 || planes.nodes[i][2] > 0.08));
}

TEST_CASE("A lattice smaller than the shape cuts it flat", "[scene]") {
  // The upper half of a ball of 50 mm, cut at z = 0 by the grid.
  const auto body =
      load_scene(Folder().write("half.json", R"({"body": {"lattice": {"nodes": [13, 13, 7], "size_m": [0.12, 0.12, 0.06],
    "origin_m": [-0.06, -0.06, 0], "clip": {"ellipsoids": [{"center_m": [0, 0, 0], "radii_m": [0.05, 0.05, 0.05]}]},
    "stiffness_n_m": 25, "damping_n_s_m": 0.1, "fixed_faces": ["z-"]}}})"))
          .body;
  CHECK(check_edges(body.triangles).closed());
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(2 * kPi / 3 * std::pow(0.05, 3)).epsilon(0.04));
  std::size_t on_floor = 0;
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    CHECK(body.nodes[i][2] >= -1e-9);
    if (body.nodes[i][2] < 1e-9) CHECK(body.fixed[i]);
    on_floor += body.nodes[i][2] < 1e-9;
  }
  CHECK(on_floor > 60);
}

TEST_CASE("The organ is one smooth closed body of about 1500 nodes", "[scene]") {
  const auto body = load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/organ-buckling.json").body;
  CHECK(body.nodes.size() > 1400);
  CHECK(body.nodes.size() < 1600);
  CHECK(check_edges(body.triangles).closed());
  CHECK(euler_characteristic(body.triangles) == 2);
  CHECK(signed_volume(body.triangles, body.nodes) > 0);
  // Smooth: neighbouring triangles never differ by more than 60 degrees.
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> normal_at;
  double sharpest = 1;
  for (const Triangle& t : body.triangles) {
    const Vec3 n = (body.nodes[t[1]] - body.nodes[t[0]]).cross(body.nodes[t[2]] - body.nodes[t[0]]).normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      normal_at[{t[i], t[(i + 1) % 3]}] = n;
      const auto twin = normal_at.find({t[(i + 1) % 3], t[i]});
      if (twin != normal_at.end()) sharpest = std::min(sharpest, n.dot(twin->second));
    }
  }
  CHECK(sharpest > 0.5);
}

/// The outside is a manifold if the triangles at each node form one closed fan.
bool fans_are_whole(const std::vector<Triangle>& triangles) {
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> next;
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (!next[t[i]].emplace(t[(i + 1) % 3], t[(i + 2) % 3]).second) return false;
    }
  }
  for (const auto& [node, fan] : next) {
    auto at = fan.begin()->first;
    std::size_t steps = 0;
    do {
      const auto it = fan.find(at);
      if (it == fan.end()) return false;
      at = it->second;
    } while (++steps <= fan.size() && at != fan.begin()->first);
    if (steps != fan.size()) return false;
  }
  return true;
}

TEST_CASE("Cells thrown at random are filled up until their outside is a manifold", "[scene]") {
  const std::vector<EllipsoidSettings> ball{{Vec3(0.5, 0.5, 0.5), Vec3(0.4, 0.4, 0.4)}};
  const auto solid = make_ellipsoids(ball, 0);
  const Grid grid{{9, 9, 9}, Vec3(0, 0, 0), Vec3(1, 1, 1)};
  std::mt19937 random(7);
  int crossed_before = 0;
  for (int run = 0; run < 40; ++run) {
    CellSet cells(grid, false);
    cells.each([&](const Index3& c) { cells.set(c, random() % 10 < 4 && c[0] > 0 && c[1] > 0 && c[2] > 0); });
    const auto before = number_nodes(grid, cells);
    crossed_before += !fans_are_whole(split_alternately(boundary_faces(cells, grid, before.number)));
    make_manifold(cells, grid, *solid);
    const auto nodes = number_nodes(grid, cells);
    const auto triangles = split_alternately(boundary_faces(cells, grid, nodes.number));
    CHECK(check_edges(triangles).closed());
    CHECK(fans_are_whole(triangles));
    CHECK(signed_volume(triangles, nodes.positions) == Approx(static_cast<double>(cells.count()) / 512).epsilon(1e-9));
  }
  CHECK(crossed_before == 40);
}

TEST_CASE("How much of a solid is left out, as it does not hang together with the rest, is known", "[scene]") {
  const std::vector<EllipsoidSettings> balls{{Vec3(-0.1, 0, 0), Vec3(0.05, 0.05, 0.05)},
                                             {Vec3(0.1, 0, 0), Vec3(0.04, 0.04, 0.04)}};
  const auto apart = make_ellipsoids(balls, 0), one = make_ellipsoids(std::span(balls).first(1), 0);
  CHECK(clip_lattice(grid_around(*one, 0.005), *one).left_out_share == Approx(0).margin(0.01));
  const double small = std::pow(0.04, 3), large = std::pow(0.05, 3);
  CHECK(clip_lattice(grid_around(*apart, 0.005), *apart).left_out_share == Approx(small / (small + large)).epsilon(0.03));
}

TEST_CASE("A smooth union bulges by a quarter of the blend where the parts meet and not elsewhere", "[scene]") {
  const std::vector<EllipsoidSettings> balls{{Vec3(-0.03, 0, 0), Vec3(0.05, 0.05, 0.05)},
                                             {Vec3(0.03, 0, 0), Vec3(0.05, 0.05, 0.05)}};
  const auto plain = make_ellipsoids(balls, 0), blended = make_ellipsoids(balls, 0.02);
  const Vec3 seam(0, 0.04, 0), far(-0.08, 0, 0);  // both on the plain union
  CHECK(plain->distance(seam) == Approx(0).margin(1e-12));
  CHECK(blended->distance(seam) == Approx(-0.005).margin(1e-12));
  CHECK(blended->distance(far) == Approx(0).margin(1e-12));
  CHECK(blended->distance(blended->nearest(Vec3(0, 0.05, 0.01))) == Approx(0).margin(1e-8));
}

TEST_CASE("The distance to a mesh agrees with a search through all its triangles, sign included", "[scene]") {
  // A cube, at whose edges and corners a sign from the nearest face alone would be wrong.
  TriangleMesh cube;
  for (int i = 0; i < 8; ++i) cube.vertices.push_back(Vec3(i & 1, i >> 1 & 1, i >> 2 & 1));
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  REQUIRE(signed_volume(cube.triangles, cube.vertices) == Approx(1));
  const auto solid = make_mesh_solid(cube);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-0.7, 1.7);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(coordinate(random), coordinate(random), coordinate(random));
    const Vec3 q = (p - Vec3::Constant(0.5)).cwiseAbs() - Vec3::Constant(0.5);
    const double expected = q.maxCoeff() > 0 ? q.cwiseMax(0).norm() : q.maxCoeff();
    CHECK(solid->distance(p) == Approx(expected).margin(1e-12));
    CHECK((solid->nearest(p) - p).norm() == Approx(std::abs(expected)).margin(1e-12));
  }
}

TEST_CASE("A clip that misses, is too fine or too coarse is refused with figures", "[scene]") {
  const Folder folder;
  const auto expect = [&](const std::string& text, const char* words) {
    const std::string message = test::error_of(folder, text);
    INFO(message);
    CHECK(message.find("scene.json:") != std::string::npos);
    CHECK(message.find(words) != std::string::npos);
  };
  expect(replaced(kBall, "0.01,", "0.08,"), "scene.json:1: body.lattice.spacing_m is 80 mm for a clip of");
  expect(replaced(kBall, "0.01,", "0.0003,"), "(200000 nodes)");
  expect(replaced(kBall, "\"spacing_m\": 0.01", "\"nodes\": [5,5,5], \"size_m\": [0.1,0.1,0.1], \"origin_m\": [1,1,1]"),
         "no cell of the lattice lies inside the clip");
  expect(replaced(kBall, "\"spacing_m\": 0.01", "\"spacing_m\": 0.01, \"nodes\": [5,5,5]"), "both given");
  expect(replaced(kBall, "[0.06, 0.05, 0.04]", "[0.06, 0, 0.04]"),
         "scene.json:2: body.lattice.clip.ellipsoids[0].radii_m[1] is 0");
  expect(replaced(kBall, "\"radii_m\": [0.06, 0.05, 0.04]", "\"radii_m\": [0.06]"), "a list of 3 numbers");
  expect(replaced(kBall, "\"center_m\": [0.01, 0.02, 0.05], ", ""), "body.lattice.clip.ellipsoids[0].center_m is missing");
  expect(replaced(kBall, "[10, 20, 30]", "[10, 20, 3000]"), "rotation_deg[2] is 3000");
  expect(replaced(kBall, "\"clip\": {", "\"clip\": {\"blend_m\": -1, "), "body.lattice.clip.blend_m is -1");
  expect(replaced(kBall, "\"clip\": {", "\"clip\": {\"mesh\": {\"file\": \"a.obj\"}, "), "expected ellipsoids or a mesh");
  expect(replaced(kBall, "}}}", "}}, \"tool\": {\"node\": [1,1,1]}}"), "tool.node is given with spacing_m");
}

}  // namespace
}  // namespace palpate
