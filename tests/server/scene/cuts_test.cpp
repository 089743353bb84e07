// Cuts that a scene gives: cells in copies, walls, masses, and what is refused.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numeric>

#include "common/base/error.hpp"
#include "common/base/random.hpp"
#include "scene_files.hpp"
#include "server/scene/cuts.hpp"
#include "server/scene/scene.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::replaced;

constexpr double kLongM = 0.06, kWideM = 0.04, kHighM = 0.05, kDensity = 1100;

std::string block(const std::string& element, const std::string& cuts) {
  return R"({"body": {"lattice": {"nodes": [7, 5, 6], "size_m": [0.06, 0.04, 0.05], "density_kg_m3": 1100, "fixed_faces": ["z-"],
    "solid": {"element": ")" +
         element + R"(", "young_pa": 5000, "poisson": 0.4}}, "cuts": [)" + cuts + "]}}";
}

std::string cut(const Vec3& from, const Vec3& to, const Vec3& direction, double depth_m) {
  return fmt::format(
      R"({{"path": [{{"at_m": [{}, {}, {}]}}, {{"at_m": [{}, {}, {}]}}], "direction": [{}, {}, {}], "depth_m": {}}})", from.x(),
      from.y(), from.z(), to.x(), to.y(), to.z(), direction.x(), direction.y(), direction.z(), depth_m);
}

LumpedBody body_of(const std::string& text) { return read_scene(text, "block.json").body; }

double mass_of(const LumpedBody& body) { return std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0); }

double shares_of(const LumpedBody& body) {
  double sum = 0;
  for (const Hexahedron& cell : body.hexahedra) sum += cell.share;
  for (const Tetrahedron& cell : body.tetrahedra) sum += cell.share;
  return sum;
}

/// Area of the triangles with a vertex on a wall.
double wall_area(const LumpedBody& body) {
  const std::vector<Vec3> x = vertices_at_rest(body);
  double area = 0;
  for (const Triangle& t : body.triangles)
    if (std::ranges::any_of(t, [&](std::uint32_t v) { return !body.is_node(v) && body.embedded[v - body.nodes.size()].is_wall; }))
      area += 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm();
  return area;
}

const std::string kDeep = cut(Vec3(0.0347, -0.01, 0.06), Vec3(0.0347, 0.05, 0.06), -Vec3::UnitZ(), 0.033);

TEST_CASE("An incision keeps mass and volume, closes its surface, and has two walls of its area", "[scene][cuts]") {
  for (const char* const element : {"hexahedron", "tetrahedron"}) {
    INFO(element);
    const LumpedBody uncut = body_of(block(element, "")), body = body_of(block(element, kDeep));
    CHECK(body.nodes.size() > uncut.nodes.size());
    CHECK(mass_of(body) == Approx(kDensity * kLongM * kWideM * kHighM).epsilon(1e-12));
    CHECK(shares_of(body) == Approx(static_cast<double>(uncut.hexahedra.size() + uncut.tetrahedra.size())).epsilon(1e-12));
    CHECK(check_edges(body.triangles).closed());
    const std::vector<Vec3> x = vertices_at_rest(body);
    CHECK(signed_volume(body.triangles, x) == Approx(kLongM * kWideM * kHighM).epsilon(1e-9));
    // The blade stops at z = 27 mm: links between 30 and 50 mm are cut, and the next row is not.
    CHECK(wall_area(body) >= 2 * kWideM * 0.0199);
    CHECK(wall_area(body) <= 2 * kWideM * 0.0301);
  }
}

TEST_CASE("A cut through the whole block leaves out the half that nothing holds", "[scene][cuts]") {
  for (const char* const element : {"hexahedron", "tetrahedron"}) {
    INFO(element);
    const LumpedBody body =
        body_of(block(element, cut(Vec3(-0.01, -0.01, 0.0249), Vec3(0.07, -0.01, 0.0249), Vec3::UnitY(), 0.08)));
    CHECK(check_edges(body.triangles).closed());
    CHECK(signed_volume(body.triangles, vertices_at_rest(body)) == Approx(kLongM * kWideM * 0.0249).epsilon(1e-9));
    CHECK(mass_of(body) == Approx(kDensity * kLongM * kWideM * 0.025).epsilon(0.02));
    for (const Vec3& x : vertices_at_rest(body)) CHECK(x.z() < 0.0301);
  }
}

TEST_CASE("Nodes that lie on a cut belong to one side of it", "[scene][cuts]") {
  const LumpedBody body =
      body_of(block("hexahedron", cut(Vec3(0.03, -0.01, 0.06), Vec3(0.03, 0.05, 0.06), -Vec3::UnitZ(), 0.035)));
  CHECK(check_edges(body.triangles).closed());
  CHECK(signed_volume(body.triangles, vertices_at_rest(body)) == Approx(kLongM * kWideM * kHighM).epsilon(1e-9));
  CHECK(mass_of(body) == Approx(kDensity * kLongM * kWideM * kHighM).epsilon(1e-12));
}

TEST_CASE("Random cuts close their surface and keep mass and volume", "[scene][cuts]") {
  Random random(31);
  const auto in = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  for (int k = 0; k < 60; ++k) {
    const char* const element = k % 2 == 0 ? "hexahedron" : "tetrahedron";
    std::string cuts;
    for (int c = 0; c <= k % 3; ++c) {
      const Vec3 from(in(-0.01, 0.07), in(-0.01, 0.05), in(0.015, 0.06)), way(in(-0.05, 0.05), in(-0.05, 0.05), in(-0.02, 0.02));
      const Vec3 down(in(-0.7, 0.7), in(-0.7, 0.7), -1);
      cuts += (c > 0 ? ", " : "") + cut(from, from + way, down, in(0.01, 0.05));
    }
    INFO(element << ": " << cuts);
    LumpedBody body;
    try {
      body = body_of(block(element, cuts));
    } catch (const InputError& error) {
      CHECK(std::string(error.what()).find("crosses no edge") != std::string::npos);
      continue;
    }
    const EdgeReport edges = check_edges(body.triangles);
    CHECK(edges.open == 0);
    CHECK(edges.flipped == 0);
    const double cells = body.hexahedra.empty() ? 6 * 6 * 4 * 5 : 6 * 4 * 5;
    // A crumb may be cut off and left out.
    CHECK(shares_of(body) <= cells * (1 + 1e-12));
    CHECK(mass_of(body) == Approx(kDensity * kLongM * kWideM * kHighM * shares_of(body) / cells).epsilon(1e-9));
    if (shares_of(body) > cells * (1 - 1e-12))
      CHECK(signed_volume(body.triangles, vertices_at_rest(body)) == Approx(kLongM * kWideM * kHighM).epsilon(1e-9));
    for (const EmbeddedVertex& vertex : body.embedded) {
      double sum = 0;
      for (const auto& [node, weight] : vertex.weights) {
        REQUIRE(node < body.nodes.size());
        CHECK(weight > 0);
        sum += weight;
      }
      CHECK(sum == Approx(1).epsilon(1e-12));
    }
  }
}

TEST_CASE("Ligaments stay on the last nodes of a cut body", "[scene][cuts]") {
  const std::string text =
      replaced(block("hexahedron", kDeep), R"("cuts")",
               R"("ligaments": [{"from_m": [0, 0, 0.05], "radius_m": 0.011, "to_m": [0, 0, 0.1], "stiffness_n_m": 50}], "cuts")");
  const LumpedBody body = body_of(text);
  CHECK(own_nodes(body) + 1 == body.nodes.size());
  CHECK(body.nodes.back() == Vec3(0, 0, 0.1));
  CHECK(body.fixed.back() == 1);
  for (const Element& e : body.elements) {
    CHECK(e.b == body.nodes.size() - 1);
    CHECK((body.nodes[e.a] - body.nodes[e.b]).norm() == Approx(e.rest_length_m));
  }
}

TEST_CASE("Cuts that cannot be made are refused with what was expected", "[scene][cuts]") {
  const Folder folder;
  const auto refused = [&](const std::string& text, const std::string& part) {
    const std::string error = error_of(folder, text);
    INFO(error);
    CHECK(error.find(part) != std::string::npos);
  };
  const std::string good = block("hexahedron", kDeep);
  CHECK(error_of(folder, good).empty());
  refused(replaced(good, R"("depth_m": 0.033)", R"("depth_m": 0)"), "body.cuts[0].depth_m");
  refused(block("hexahedron", cut(Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3::UnitZ(), 0.1)), "body.cuts[0] crosses no edge");
  refused(block("hexahedron", cut(Vec3::Zero(), Vec3::UnitZ(), Vec3::UnitZ(), 0.1)), "along body.cuts[0].direction");
  refused(block("hexahedron", cut(Vec3::Zero(), Vec3::UnitZ(), Vec3::Zero(), 0.1)), "no length");
  refused(replaced(good, R"("path": [{"at_m")", R"("path": [{"at")"), "at_m");
  refused(
      R"({"body": {"lattice": {"nodes": [4, 4, 4], "size_m": [0.1, 0.1, 0.1], "stiffness_n_m": 60, "damping_n_s_m": 0.2, "fixed_faces": ["z-"]}, "cuts": [)" +
          kDeep + "]}}",
      "given for springs");
}

const std::string kTears = R"("tears": true, "tissue": [{"toughness_j_m2": 20}], "cuts")";
const std::string kClip = R"("clips": [{"at_m": [0.03, 0.02, 0.04], "radius_m": 0.012, "stiffness_n_m": 500}], "cuts")";

TEST_CASE("A scene keeps its cuts where they tear on, and refuses tears and clips that cannot be", "[scene][cuts]") {
  const Folder folder;
  const auto refused = [&](const std::string& text, const std::string& part) {
    const std::string error = error_of(folder, text);
    INFO(error);
    CHECK(error.find(part) != std::string::npos);
  };
  const std::string good = block("hexahedron", kDeep), tears = replaced(good, "\"cuts\"", kTears);
  CHECK_FALSE(read_scene(good, "block.json").tearing);
  const Scene scene = read_scene(tears, "block.json");
  REQUIRE(scene.tearing);
  CHECK(scene.tearing->body().nodes == scene.body.nodes);
  CHECK(scene.tearing->cuts().size() == 1);
  CHECK(scene.is_cut_live());
  refused(replaced(tears, "\"tears\": true", "\"tears\": 1"), "body.tears");
  refused(replaced(tears, kDeep, ""), "body.tears is given without body.cuts");
  refused(replaced(tears, R"("tissue": [{"toughness_j_m2": 20}], )", ""), "0 layers of body.tissue");
  refused(replaced(good, "\"cuts\"", replaced(kClip, "0.012", "0.002")), "body.clips[0] has no two nodes of a cell in reach");
  refused(replaced(good, "\"cuts\"", replaced(kClip, "500", "0")), "body.clips[0].stiffness_n_m");
}

TEST_CASE("A clip has springs on both sides of a cut and across it, and holds what the cut takes off", "[scene][cuts]") {
  const std::string text = replaced(block("hexahedron", kDeep), "\"cuts\"", kClip);
  const LumpedBody body = body_of(text), without = body_of(block("hexahedron", kDeep));
  REQUIRE_FALSE(body.elements.empty());
  double stiffness = 0;
  int across = 0;
  for (const Element& e : body.elements) {
    stiffness += e.stiffness_n_m;
    CHECK((body.nodes[e.a] - body.nodes[e.b]).norm() == Approx(e.rest_length_m));
    across += (body.nodes[e.a].x() < 0.0347) != (body.nodes[e.b].x() < 0.0347);
  }
  CHECK(stiffness == Approx(500));
  CHECK(across > 0);
  CHECK(body.nodes == without.nodes);
  // The lower half is fixed; a clip across the cut holds the upper one.
  const std::string through = cut(Vec3(-0.01, -0.01, 0.0249), Vec3(0.07, -0.01, 0.0249), Vec3::UnitY(), 0.08);
  const std::string clip = replaced(kClip, "[0.03, 0.02, 0.04]", "[0.03, 0.02, 0.025]");
  CHECK(mass_of(body_of(replaced(block("hexahedron", through), "\"cuts\"", clip))) ==
        Approx(kDensity * kLongM * kWideM * kHighM).epsilon(1e-9));
}

TEST_CASE("The printed scene has its cuts", "[scene][cuts]") {
  const Folder folder;
  for (const std::string& cuts : {std::string("\"cuts\""), kTears, kClip}) {
    const auto file = folder.write("cut.json", replaced(block("hexahedron", kDeep), "\"cuts\"", cuts));
    const std::string printed = print_scene(file);
    CHECK(print_scene(folder.write("again.json", printed)) == printed);
    for (const std::string& key : {std::string("\"cuts\""), cuts.substr(0, cuts.find(':'))})
      CHECK(printed.find(key) != std::string::npos);
  }
}

}  // namespace
}  // namespace palpate
