// Several bodies in a scene: what is read, how they are joined, and what is refused.
#include <catch2/catch.hpp>

#include "scene_files.hpp"
#include "server/scene/parts.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::replaced;

// A block of 60 mm, and one of half its size on it.
const std::string kTwo = R"({"bodies": [
  {"name": "below", "mu": 0.4, "lattice": {
    "nodes": [4, 4, 4], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"], "solid": {"young_pa": 5000}}},
  {"name": "above", "colour": "#12ab9F", "self_contact": true, "lattice": {
    "nodes": [3, 3, 3], "size_m": [0.03, 0.03, 0.03], "origin_m": [0.01, 0.01, 0.06],
    "solid": {"young_pa": 9000, "capsule": {"young_pa": 1e5, "thickness_m": 1e-4}}},
    "ligaments": [{"from_m": [0.025, 0.025, 0.095], "radius_m": 0.04, "to_m": [0.025, 0.025, 0.12], "stiffness_n_m": 100}]}]})";

TEST_CASE("Bodies of a list are joined, each with its name, colour, cells, surface and material", "[scene][members]") {
  const Folder folder;
  const LumpedBody body = load_scene(folder.write("scene.json", kTwo)).body;
  REQUIRE(body.members.size() == 2);
  const Member &below = body.members[0], &above = body.members[1];
  CHECK(below.name == "below");
  CHECK(below.friction == 0.4);
  CHECK_FALSE(below.touches_itself);
  CHECK(above.name == "above");
  CHECK(above.colour == 0x12ab9f);
  CHECK(above.touches_itself);
  CHECK(below.first_node == 0);
  CHECK(below.end_node == 64);
  CHECK(above.first_node == 64);
  CHECK(above.end_node == 64 + 27);
  CHECK(own_nodes(body) == 64 + 27);
  CHECK(body.nodes.size() == 64 + 27 + 1);
  CHECK(body.hexahedra.size() == 27 + 8);
  CHECK(body.materials[body.hexahedra.front().material].young_pa == 5000);
  CHECK(body.materials[body.hexahedra.back().material].young_pa == 9000);
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(0.06 * 0.06 * 0.06 + 0.03 * 0.03 * 0.03));
  for (const Element& spring : body.elements) CHECK(spring.a >= above.first_node);
  const auto at = above.distance->at(Vec3(0.025, 0.025, 0.064));
  REQUIRE(at);
  CHECK(at->distance_m == Approx(-0.004).margin(1e-4));
  CHECK((at->gradient + Vec3::UnitZ()).norm() < 0.01);
}

TEST_CASE("Bodies that overlap are refused with their names, the depth and the place", "[scene][members]") {
  const Folder folder;
  CHECK(error_of(folder, kTwo).empty());  // they touch
  const std::string before = R"(bodies[0] ("below") and bodies[1] ("above") overlap by )";
  const std::string deep = error_of(folder, replaced(kTwo, "0.01, 0.01, 0.06]", "0.01, 0.01, 0.0575]"));
  REQUIRE(deep.find(before) != std::string::npos);
  CHECK(deep.substr(deep.find(before) + before.size()).starts_with("2.5 mm at "));
  const std::string corner = error_of(folder, replaced(kTwo, "0.01, 0.01, 0.06]", "0.047, 0.047, 0.0555]"));
  CHECK(corner.find(before + "4.5 mm at (0.047, 0.047, 0.0555) m") != std::string::npos);
}

TEST_CASE("A body of a list is refused by the name that it has in the file", "[scene][members]") {
  const Folder folder;
  const auto error = [&](const std::string& from, const std::string& to) { return error_of(folder, replaced(kTwo, from, to)); };
  CHECK(error("9000", "-9000").find("scene.json:6: bodies[1].lattice.solid.young_pa is -9000") != std::string::npos);
  CHECK(error("\"radius_m\": 0.04, \"to_m\": [0.025, 0.025, 0.12]", "\"radius_m\": 0.001, \"to_m\": [0, 0, 0]")
            .find("bodies[1].ligaments[0] reaches no free node") != std::string::npos);
  CHECK(error("\"name\": \"above\", ", "").find("bodies[1].name is missing") != std::string::npos);
  CHECK(error("\"above\"", "\"below\"").find("bodies[1].name is \"below\", as that of a body before") != std::string::npos);
  CHECK(error("\"self_contact\": true", "\"self_contact\": 1").find("bodies[1].self_contact is a number") != std::string::npos);
  CHECK(error("\"solid\": {\"young_pa\": 5000}", "\"stiffness_n_m\": 10, \"damping_n_s_m\": 0.1")
            .find("bodies[0].lattice is of springs among several bodies") != std::string::npos);
  CHECK(error("\"young_pa\": 9000", "\"young_pa\": 9000, \"law\": \"corotational\"")
            .find("bodies[1] (\"above\") has another law, shape of it or fibres than bodies[0] (\"below\")") !=
        std::string::npos);
  CHECK(error("\"young_pa\": 9000", "\"young_pa\": 9000, \"element\": \"tetrahedron\"").find("has other elements than") !=
        std::string::npos);
  CHECK(error("{\"bodies\"", "{\"body\": {}, \"bodies\"").find("body and bodies are both given") != std::string::npos);
  CHECK(error("\"mu\": 0.4, ", "\"mu\": 0.4, \"cuts\": [], ").find("bodies[0].cuts is given among several bodies") !=
        std::string::npos);
  CHECK(error("}]}]}", "}]}], \"tool\": {\"node\": [0, 0, 0]}}").find("tool.node is given with bodies") != std::string::npos);
  CHECK(error_of(folder, R"({"bodies": []})").find("bodies has 0 of them") != std::string::npos);
  CHECK(error_of(folder, R"({"body": {"name": "a"}})").find("body.name is given for the only body") != std::string::npos);
}

TEST_CASE("A scene with several bodies is printed as it is read", "[scene][members]") {
  const Folder folder;
  const std::string printed = print_scene(folder.write("scene.json", kTwo));
  CHECK(print_scene(folder.write("scene.json", printed)) == printed);
  CHECK(printed.find("#c86464") != std::string::npos);
  CHECK(printed.find("\"self_contact\": true") != std::string::npos);
}

}  // namespace
}  // namespace palpate
