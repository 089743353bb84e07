// Lumps and training tasks of scenes: what they do to the body, and the answers to mistakes.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numbers>

#include "scene_files.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::replaced;

/// A block of 120 x 120 x 60 mm whose top is free, with another stiffness in a ball.
std::string block(const std::string& matter, const std::string& lump, const std::string& task = "") {
  return R"({"body": {"lattice": {"nodes": [13, 13, 7], "size_m": [0.12, 0.12, 0.06], "fixed_faces": ["z-"], )" + matter + "}" +
         (lump.empty() ? "" : ",\n\"lump\": " + lump) + "},\n\"tool\": {\"contact\": \"touch\"}" +
         (task.empty() ? "" : ",\n\"task\": " + task) + "}";
}
const std::string kSolid = R"("solid": {"young_pa": 5000})", kTetra = R"("solid": {"young_pa": 5000, "element": "tetrahedron"})",
                  kLump = R"({"center_m": [0.06, 0.06, 0.04], "radius_m": 0.015, "stiffness_ratio": 5})";

double volume_of(const Hexahedron& cell, const std::vector<Vec3>& x) {
  return (x[cell.nodes[1]] - x[cell.nodes[0]]).norm() * (x[cell.nodes[2]] - x[cell.nodes[0]]).norm() *
         (x[cell.nodes[4]] - x[cell.nodes[0]]).norm();
}
double volume_of(const Tetrahedron& cell, const std::vector<Vec3>& x) {
  const Vec3 a = x[cell.nodes[1]] - x[cell.nodes[0]], b = x[cell.nodes[2]] - x[cell.nodes[0]],
             c = x[cell.nodes[3]] - x[cell.nodes[0]];
  return a.dot(b.cross(c)) / 6;
}

template <class Cells>
double volume_of_lump(const LumpedBody& body, const Cells& cells, double young_pa, double ratio) {
  double volume = 0;
  for (const auto& cell : cells)
    volume += volume_of(cell, body.nodes) * (body.materials[cell.material].young_pa / young_pa - 1) / (ratio - 1);
  return volume;
}

}  // namespace

TEST_CASE("a lump stiffens the body by its own volume, wherever it lies and whatever the elements are", "[scene]") {
  const Folder folder;
  const double ball = 4 * std::numbers::pi / 3 * std::pow(0.015, 3);
  for (const char* center : {"[0.06, 0.06, 0.04]", "[0.0633, 0.0571, 0.0386]", "[0.04, 0.08, 0.03]"}) {
    const std::string lump = replaced(kLump, "[0.06, 0.06, 0.04]", center);
    const Scene hexahedra = load_scene(folder.write("h.json", block(kSolid, lump)));
    CHECK(volume_of_lump(hexahedra.body, hexahedra.body.hexahedra, 5000, 5) == Approx(ball).epsilon(0.05));
    const Scene tetrahedra = load_scene(folder.write("t.json", block(kTetra, lump)));
    CHECK(volume_of_lump(tetrahedra.body, tetrahedra.body.tetrahedra, 5000, 5) == Approx(ball).epsilon(0.05));
  }
}

TEST_CASE("a spring is stiffer by the share of its length that is in the lump", "[scene]") {
  const Folder folder;
  const std::string springs = R"("stiffness_n_m": 50, "damping_n_s_m": 0.1)";
  const Scene plain = load_scene(folder.write("p.json", block(springs, ""))),
              lumped = load_scene(folder.write("l.json", block(springs, kLump)));
  const Vec3 centre(0.06, 0.06, 0.04);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < plain.body.elements.size(); ++i) {
    const Element &before = plain.body.elements[i], &after = lumped.body.elements[i];
    int inside = 0;
    constexpr int kPoints = 2000;
    for (int k = 0; k < kPoints; ++k) {
      const double s = (k + 0.5) / kPoints;
      inside += ((1 - s) * plain.body.nodes[before.a] + s * plain.body.nodes[before.b] - centre).norm() <= 0.015;
    }
    const double factor = 1 + 4.0 * inside / kPoints;
    if (std::abs(after.stiffness_n_m - factor * before.stiffness_n_m) > 0.15 ||
        std::abs(after.damping_n_s_m - factor * before.damping_n_s_m) > 3e-4)
      FAIL("spring " << i << ": " << after.stiffness_n_m << " N/m, " << inside << " of its points inside");
    changed += inside > 0;
  }
  CHECK(changed > 20);
}

TEST_CASE("a line lies on the surface, with its normals, in short steps", "[scene]") {
  const Folder folder;
  const Scene scene = load_scene(folder.write(
      "line.json", block(kSolid, "", R"({"trace": {"line": [{"at_m": [0.02, 0.03, 0.0602]}, {"at_m": [0.1, 0.03, 0.0598]}]}})")));
  const auto& trace = std::get<TraceTask>(scene.task->goal);
  CHECK(trace.tolerance_m == 0.002);
  REQUIRE(trace.line.size() == 17);
  for (std::size_t i = 0; i < trace.line.size(); ++i) {
    CHECK(trace.line[i].at.isApprox(Vec3(0.02 + 0.005 * static_cast<double>(i), 0.03, 0.06), 1e-9));
    CHECK(trace.line[i].normal.isApprox(Vec3::UnitZ()));
  }
  CHECK(scene.task->text == "Follow the line within 2 mm, from the ring on");
}

TEST_CASE("the surface point above a lump is the nearest that can move", "[scene]") {
  const Folder folder;
  const std::string low = replaced(kLump, "0.04]", "0.018]");  // nearer to the held face below
  const Scene scene =
      load_scene(folder.write("low.json", block(kSolid, low, R"({"text": "Where?", "find": {"within_m": 0.02}})")));
  const auto& find = std::get<FindTask>(scene.task->goal);
  CHECK(scene.task->text == "Where?");
  CHECK(find.lump == Vec3(0.06, 0.06, 0.018));
  CHECK(find.within_m == 0.02);
  CHECK(find.above.isApprox(Vec3(0.06, 0.06, 0.06), 1e-9));
}

TEST_CASE("mistakes in lumps and tasks are answered with line, place and what was expected", "[scene]") {
  const Folder folder;
  const auto says = [&](const std::string& scene, std::initializer_list<const char*> words) {
    const std::string error = error_of(folder, scene);
    INFO(error);
    CHECK(error.find('\n') == std::string::npos);
    for (const char* word : words) CHECK(error.find(word) != std::string::npos);
  };
  const auto lump = [](const char* from, const char* to) { return block(kSolid, replaced(kLump, from, to)); };
  says(lump("0.04]", "0.07]"), {":2: ", "body.lump.center_m [0.06, 0.06, 0.07] is outside the body", "[0.0600, 0.0600, 0.0600]"});
  says(lump("\"radius_m\": 0.015", "\"radius_m\": 0.0002"), {"body.lump.radius_m is 0.0002", "0.001 to 1 m"});
  says(lump("[0.06, 0.06, 0.04], \"radius_m\": 0.015", "[0.0601, 0.0601, 0.0401], \"radius_m\": 0.001"),
       {"too small to change an element", "0.0042 m"});
  says(lump("\"stiffness_ratio\": 5", "\"stiffness_ratio\": 0"), {"body.lump.stiffness_ratio is 0", "0.01 to 100"});
  const auto task = [](const std::string& text) { return block(kSolid, "", text); };
  says(task("{}"), {"task states no goal", "one of find, press and trace"});
  says(task(R"({"find": {}})"), {"task.find has nothing to find", "body.lump"});
  says(task(R"({"find": {}, "press": {"min_n": 1, "max_n": 2, "time_s": 1}})"), {"more than one goal"});
  says(task(R"({"press": {"min_n": 2, "max_n": 1, "time_s": 1}})"),
       {"task.press.min_n is 2", "task.press.max_n is 1", "min_n below max_n"});
  says(task(R"({"press": {"min_n": 1, "max_n": 2}})"), {"task.press.time_s", "a number of s"});
  says(task(R"({"text": "a\nb", "press": {"min_n": 1, "max_n": 2, "time_s": 1}})"), {"task.text", "1 to 160 bytes"});
  says(task(R"({"trace": {"line": [{"at_m": [0.02, 0.03, 0.06]}]}})"), {"task.trace.line has 1 points", "2 to 24"});
  says(task(R"({"trace": {"line": [{"at_m": [0.02, 0.03, 0.06]}, {"at_m": [0.1, 0.03, 0.08]}]}})"),
       {"task.trace.line[1].at_m is 20.0 mm off the surface", "[0.1000, 0.0300, 0.0600]"});
  says(task(R"({"trace": {"line": [{"at_m": [0.02, 0.0, 0.02]}, {"at_m": [0.02, 0.12, 0.02]}]}})"),
       {"task.trace.line[1] cannot be reached along the surface"});
  says(task(R"({"trace": {"lines": []}})"), {"task.trace.lines is not a known field", "\"line\"?"});
  says(replaced(task(R"({"trace": {"line": [{"at_m": [0.02, 0.03, 0.06]}, {"at_m": [0.1, 0.03, 0.06]}]}})"), "touch", "attach"),
       {"needs a surface that the tool touches"});
}

}  // namespace palpate
