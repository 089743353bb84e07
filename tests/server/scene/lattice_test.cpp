// Boxes and sheets against independently computed counts, positions and masses.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numeric>
#include <set>

#include "scene_files.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

using test::Folder;
using test::kSoftCube;
using test::replaced;

Scene load(const std::string& text) { return load_scene(Folder().write("scene.json", text)); }

std::size_t node(int n, int i, int j, int k) { return static_cast<std::size_t>(i + n * (j + n * k)); }

double total_mass(const LumpedBody& body) { return std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0); }

TEST_CASE("A cube has a spring from every node to all its neighbours, counted in closed form", "[scene]") {
  for (const int n : {2, 3, 6, 9}) {
    const auto count = std::to_string(n);
    const auto body =
        load(replaced(replaced(kSoftCube, "[6, 6, 6]", "[" + count + "," + count + "," + count + "]"), "2, 2, 5", "1,1,1")).body;
    const int m = n - 1;
    CHECK(body.nodes.size() == static_cast<std::size_t>(n * n * n));
    CHECK(body.elements.size() == static_cast<std::size_t>(3 * n * n * m + 6 * n * m * m + 4 * m * m * m));
    CHECK(body.triangles.size() == static_cast<std::size_t>(12 * m * m));
  }
}

TEST_CASE("Every pair of nodes within a cell's diagonal is joined once, at its own distance", "[scene]") {
  const auto body = load(kSoftCube).body;
  std::set<std::pair<std::uint32_t, std::uint32_t>> joined;
  for (const Element& e : body.elements) {
    CHECK(joined.insert({std::min(e.a, e.b), std::max(e.a, e.b)}).second);
    CHECK(e.rest_length_m == Approx((body.nodes[e.a] - body.nodes[e.b]).norm()).epsilon(1e-14));
  }
  std::size_t near = 0;
  for (std::uint32_t a = 0; a < body.nodes.size(); ++a) {
    for (std::uint32_t b = a + 1; b < body.nodes.size(); ++b) {
      if ((body.nodes[a] - body.nodes[b]).cwiseAbs().maxCoeff() > 0.02 * 1.001) continue;
      ++near;
      CHECK(joined.count({a, b}) == 1);
    }
  }
  CHECK(near == joined.size());
}

TEST_CASE("Node (i, j, k) rests at (i, j, k) times size over nodes less one, with index i + nx (j + ny k)", "[scene]") {
  const std::string moved = replaced(kSoftCube, "[0.1, 0.1, 0.1]", "[0.1, 0.2, 0.3], \"origin_m\": [1, -1, 0.5]");
  const auto body = load(replaced(moved, "\"below_z_m\": 0.06", "\"below_z_m\": 0.6")).body;
  CHECK((body.nodes[node(6, 0, 0, 0)] - Vec3(1, -1, 0.5)).norm() < 1e-15);
  CHECK((body.nodes[node(6, 4, 2, 3)] - Vec3(1.08, -0.92, 0.68)).norm() < 1e-15);
  CHECK((body.nodes.back() - Vec3(1.1, -0.8, 0.8)).norm() < 1e-15);
}

TEST_CASE("Density times volume is shared equally by all nodes, fixed ones included", "[scene]") {
  const auto body = load(kSoftCube).body;
  CHECK(body.masses_kg.size() == 216);
  for (const double m : body.masses_kg) CHECK(m == Approx(1.0 / 216).epsilon(1e-14));
}

TEST_CASE("A layer takes the elements whose midpoint lies below it and no others", "[scene]") {
  const auto body = load(kSoftCube).body;
  std::size_t soft = 0;
  for (const Element& e : body.elements) {
    const double z = 0.5 * (body.nodes[e.a][2] + body.nodes[e.b][2]);
    const bool below = z < 0.06 - 1e-9;
    CHECK(e.stiffness_n_m == (below ? 20 : 60));
    CHECK(e.damping_n_s_m == (below ? 0.08 : 0.24));
    soft += below;
  }
  // Three planes of 110 elements below z = 0.06 and three gaps of 256 (36 upright, 120 across faces, 100 across cells).
  CHECK(soft == 3 * 110 + 3 * 256);
}

TEST_CASE("Where layers overlap the later one wins, and what a layer leaves out stays as it is", "[scene]") {
  const auto body = load(replaced(kSoftCube, "\"damping_n_s_m\": 0.08}",
                                  "\"damping_n_s_m\": 0.08}, {\"below_z_m\": 0.03, \"above_x_m\": 0.05, "
                                  "\"stiffness_n_m\": 5}"))
                        .body;
  for (const Element& e : body.elements) {
    const Vec3 m = 0.5 * (body.nodes[e.a] + body.nodes[e.b]);
    const bool second = m[2] < 0.03 - 1e-9 && m[0] > 0.05 - 1e-9;
    const bool first = m[2] < 0.06 - 1e-9;
    CHECK(e.stiffness_n_m == (second ? 5 : first ? 20 : 60));
    CHECK(e.damping_n_s_m == (second ? 0.24 : first ? 0.08 : 0.24));
  }
}

TEST_CASE("Fixed faces hold exactly the nodes on them", "[scene]") {
  const auto body = load(replaced(kSoftCube, "[\"z-\"]", "[\"z-\", \"x+\"]")).body;
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    const bool on_face = body.nodes[i][2] < 1e-9 || body.nodes[i][0] > 0.1 - 1e-9;
    CHECK((body.fixed[i] != 0) == on_face);
  }
}

TEST_CASE("Gravity, spring law and solver reach the scene, from the lattice or from the body", "[scene]") {
  const char* extra = "\"gravity_m_s2\": [0, 0, -9.81], \"spring_law\": \"stiffening\", \"stiffening\": 4, ";
  for (const char* place : {"\"nodes\"", "\"lattice\""}) {
    const Scene scene = load(
        replaced(replaced(kSoftCube, place, extra + std::string(place)), "\"tool\"", "\"solver\": {\"step_ms\": 2}, \"tool\""));
    CHECK(scene.body.gravity_m_s2 == Vec3(0, 0, -9.81));
    CHECK(scene.body.law == SpringLaw::stiffening);
    CHECK(scene.body.stiffening == 4);
    CHECK(scene.solver.step_s == Approx(0.002));
  }
  const Scene plain = load(kSoftCube);
  CHECK(plain.body.gravity_m_s2 == Vec3(0, 0, 0));
  CHECK(plain.body.law == SpringLaw::linear);
  CHECK(load(replaced(kSoftCube, "\"nodes\"", "\"spring_law\": \"thigh-skin\", \"nodes\"")).body.law == SpringLaw::thigh_skin);
}

TEST_CASE("A sheet has 8 neighbours, no surface, and the same body in both ways of writing it", "[scene]") {
  const std::string rest =
      R"("stiffness_n_m": 100, "damping_n_s_m": 0.5, "fixed_faces": ["y-"]}}, "tool": {"contact": "attach"}})";
  const Scene a = load(R"({"body": {"lattice": {"nodes": [13, 7], "size_m": [0.12, 0.06], "thickness_m": 0.02, )" + rest);
  const Scene b = load(R"({"body": {"lattice": {"nodes": [13, 7, 1], "size_m": [0.12, 0.06, 0.02], )" + rest);
  for (const Scene* s : {&a, &b}) {
    CHECK(s->body.planar);
    CHECK(s->body.nodes.size() == 91);
    CHECK(s->body.elements.size() == 12 * 7 + 13 * 6 + 2 * 12 * 6);
    CHECK(s->body.triangles.empty());
    CHECK(total_mass(s->body) == Approx(1000 * 0.12 * 0.06 * 0.02).epsilon(1e-12));
    CHECK(s->tool.node == 6 + 13 * 6);  // middle of the top edge
    for (const Vec3& x : s->body.nodes) CHECK(x[2] == 0);
  }
}

TEST_CASE("The surface of a box is closed, faces outwards and encloses its volume", "[scene]") {
  const auto body = load(replaced(replaced(kSoftCube, "[6, 6, 6]", "[5, 4, 3]"), "2, 2, 5", "2, 2, 2")).body;
  CHECK(check_edges(body.triangles).closed());
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(0.001).epsilon(1e-12));
  std::set<std::uint32_t> used;
  for (const Triangle& t : body.triangles) {
    used.insert(t.begin(), t.end());
    const Vec3 normal = (body.nodes[t[1]] - body.nodes[t[0]]).cross(body.nodes[t[2]] - body.nodes[t[0]]);
    CHECK(normal.dot(body.nodes[t[0]] + body.nodes[t[1]] + body.nodes[t[2]] - 3 * Vec3(0.05, 0.05, 0.05)) > 0);
  }
  CHECK(static_cast<int>(used.size()) - static_cast<int>(body.triangles.size()) / 2 == 2);  // Euler: V - E + F with E = 3 F / 2
}

TEST_CASE("The tool takes the named node, or the middle of the top", "[scene]") {
  CHECK(load(kSoftCube).tool.node == node(6, 2, 2, 5));
  CHECK(load(kSoftCube).tool.contact == ContactKind::attach);
  CHECK(load(replaced(kSoftCube, ", \"node\": [2, 2, 5]", "")).tool.node == node(6, 2, 2, 5));
  const Scene touch = load(replaced(kSoftCube, R"("contact": "attach", "node": [2, 2, 5])", ""));
  CHECK(touch.tool.contact == ContactKind::touch);
  CHECK(touch.tool.friction == 0.3);
  CHECK(touch.tool.contact_stiffness_n_m == 1000);
}

}  // namespace
}  // namespace palpate
