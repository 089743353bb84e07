// A printed scene reads back as the same scene.
#include <catch2/catch.hpp>

#include "scene_files.hpp"

namespace palpate {
namespace {

using test::Folder;
using test::replaced;

void check_same(const Scene& a, const Scene& b) {
  CHECK(a.name == b.name);
  CHECK(a.tool.contact == b.tool.contact);
  CHECK(a.tool.node == b.tool.node);
  CHECK(a.tool.friction == b.tool.friction);
  CHECK(a.tool.contact_stiffness_n_m == b.tool.contact_stiffness_n_m);
  CHECK(a.tool.radius_m == b.tool.radius_m);
  CHECK(a.solver.step_s == b.solver.step_s);
  CHECK(a.body.planar == b.body.planar);
  CHECK(a.body.nodes == b.body.nodes);
  CHECK(a.body.masses_kg == b.body.masses_kg);
  CHECK(a.body.fixed == b.body.fixed);
  CHECK(a.body.triangles == b.body.triangles);
  CHECK(a.body.law == b.body.law);
  CHECK(a.body.stiffening == b.body.stiffening);
  CHECK(a.body.gravity_m_s2 == b.body.gravity_m_s2);
  CHECK(a.task == b.task);
  REQUIRE(a.body.materials.size() == b.body.materials.size());
  for (std::size_t i = 0; i < a.body.materials.size(); ++i) CHECK(a.body.materials[i].young_pa == b.body.materials[i].young_pa);
  REQUIRE(a.body.elements.size() == b.body.elements.size());
  for (std::size_t i = 0; i < a.body.elements.size(); ++i) {
    const Element &x = a.body.elements[i], &y = b.body.elements[i];
    const bool same = x.a == y.a && x.b == y.b && x.rest_length_m == y.rest_length_m && x.stiffness_n_m == y.stiffness_n_m &&
                      x.damping_n_s_m == y.damping_n_s_m;
    if (!same) FAIL("element " << i << " differs");
  }
}

TEST_CASE("A printed scene loads to the same body to the bit, and prints the same again", "[scene]") {
  const Folder folder;
  std::vector<std::filesystem::path> files;
  for (const char* name : {"cube6", "softcore6", "sheet13", "touch-cube", "organ", "organ-buckling"}) {
    files.push_back(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes" / (std::string(name) + ".json"));
  }
  files.push_back(folder.write("odd.json", replaced(replaced(test::kSoftCube, "0.24", "0.1234567890123456789"), "\"tool\"",
                                                    R"("solver": {"step_ms": 7.3}, "tool")")));
  files.push_back(folder.write("named by its file.json",
                               replaced(replaced(test::kSoftCube, "\"name\": \"cube6\",", ""), "\"nodes\"",
                                        R"("spring_law": "stiffening", "gravity_m_s2": [0, 1e-7, -9.81], "nodes")")));
  for (const char* name : {"find", "press", "trace"})
    files.push_back(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/tasks" / (std::string(name) + ".json"));
  for (const auto& file : files) {
    INFO(file);
    const std::string printed = print_scene(file);
    const auto copy = folder.write("printed.json", printed);
    check_same(load_scene(file), load_scene(copy));
    CHECK(print_scene(copy) == printed);
  }
}

TEST_CASE("A printed scene shows the defaults", "[scene]") {
  const Folder folder;
  const std::string printed = print_scene(folder.write("plain.json", R"({"body": {"lattice": {
    "nodes": [3, 3, 3], "size_m": [0.1, 0.1, 0.1], "stiffness_n_m": 60, "damping_n_s_m": 0.1}}})"));
  for (const char* line : {R"("name": "plain")", R"("density_kg_m3": 1000)", R"("spring_law": "linear")",
                           R"("gravity_m_s2": [0, 0, 0])", R"("contact": "touch")", R"("mu": 0.3)",
                           R"("contact_stiffness_n_m": 1000)", R"("step_ms": 10)", R"("fixed_faces": [])"}) {
    INFO(printed);
    CHECK(printed.find(line) != std::string::npos);
  }
}

TEST_CASE("Names with escapes and other scripts survive printing", "[scene]") {
  const Folder folder;
  const auto file = folder.write("name.json", replaced(test::kSoftCube, "\"cube6\"", R"("a b \\ \u00e9 肝")"));
  CHECK(load_scene(file).name == "a b \\ \xC3\xA9 \xE8\x82\x9D");
  CHECK(load_scene(folder.write("again.json", print_scene(file))).name == load_scene(file).name);
}

}  // namespace
}  // namespace palpate
