// Possible mistakes of a user in a scene, and the line and text of the answer.
#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "scene_files.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::kSoftCube;
using test::replaced;

struct Mistake {
  const char *from, *to;
  int line;
  const char *field, *expected;
};

// Lines are those of kSoftCube: name 2, body 3, lattice 4, nodes 5, size 6, density 7, stiffness 8, damping 9, faces 10, layers
// 11, tool 14.
const Mistake kMistakes[] = {
    // out of range
    {"\"cube6\"", "\"\"", 2, "name", "1 to 64 bytes"},
    {"\"cube6\"", "\"a\\nb\"", 2, "name is \"a?b\"", "without control characters"},
    {"[6, 6, 6]", "[1, 6, 6]", 5, "body.lattice.nodes[0] is 1", "2 to 200"},
    {"[6, 6, 6]", "[6, 6, 201]", 5, "body.lattice.nodes[2] is 201", "2 to 200"},
    {"[6, 6, 6]", "[6, 0, 6]", 5, "body.lattice.nodes[1] is 0", "2 to 200"},
    {"[6, 6, 6]", "[200, 200, 200]", 5, "body.lattice.nodes", "at most 1000000 nodes"},
    {"[6, 6, 6]", "[6]", 5, "body.lattice.nodes is [6]", "3 whole numbers"},
    {"[6, 6, 6]", "[6, 6, 6, 6]", 5, "body.lattice.nodes", "3 whole numbers"},
    {"[6, 6, 6]", "[6.5, 6, 6]", 5, "body.lattice.nodes[0] is 6.5", "a whole number"},
    {"[6, 6, 6]", "[99999999999, 6, 6]", 5, "body.lattice.nodes[0]", "a whole number"},
    {"[0.1, 0.1, 0.1]", "[0.1, 0.1]", 6, "body.lattice.size_m", "[sx, sy, sz]"},
    {"[0.1, 0.1, 0.1]", "[0.1, -0.1, 0.1]", 6, "body.lattice.size_m[1] is -0.1", "0.001 to 5 m"},
    {"[0.1, 0.1, 0.1]", "[0.1, 0.1, 1e999]", 6, "body.lattice.size_m[2] is 1e999", "a finite number"},
    {"1000,", "0,", 7, "body.lattice.density_kg_m3 is 0", "1 to 30000 kg/m^3"},
    {"60,", "-60,", 8, "body.lattice.stiffness_n_m is -60", "0.001 to 1"},
    {"0.24,", "-0.24,", 9, "body.lattice.damping_n_s_m is -0.24", "N s/m"},
    {"\"z-\"", "\"w-\"", 10, "body.lattice.fixed_faces[0] is \"w-\"", "\"x-\", \"x+\""},
    {"\"below_z_m\": 0.06,", "\"below_z_m\": 60,", 11, "body.lattice.layers[0].below_z_m is 60", "-10 to 10 m"},
    {"\"below_z_m\": 0.06, ", "", 11, "body.lattice.layers[0] has no bound", "below_z_m"},
    {", \"stiffness_n_m\": 20, \"damping_n_s_m\": 0.08", "", 11, "body.lattice.layers[0] changes nothing",
     "stiffness_n_m or damping_n_s_m"},
    {"\"stiffness_n_m\": 20", "\"stiffness_n_m\": 0", 11, "body.lattice.layers[0].stiffness_n_m is 0", "N/m"},
    {"0.08}", "-1}", 11, "body.lattice.layers[0].damping_n_s_m is -1", "N s/m"},
    {"\"attach\"", "\"glue\"", 14, "tool.contact is \"glue\"", "\"attach\" or \"touch\""},
    {"[2, 2, 5]", "[2, 2, 6]", 14, "tool.node[2] is 6", "0 to 5"},
    {"[2, 2, 5]", "[2, 2]", 14, "tool.node", "[i, j, k]"},
    {"[2, 2, 5]", "[2, 2, 0]", 14, "tool.node [2, 2, 0] is fixed", "a node that can move"},
    {"[2, 2, 5]", "[2, 2, 5], \"mu\": -0.1", 14, "tool.mu is -0.1", "0 to 2"},
    {"[2, 2, 5]", "[2, 2, 5], \"radius_m\": -0.001", 14, "tool.radius_m is -0.001", "0 to 0.5 m"},
    {"[2, 2, 5]", "[2, 2, 5], \"contact_stiffness_n_m\": 0", 14, "tool.contact_stiffness_n_m is 0", "N/m"},
    {"\"tool\"", "\"solver\": {\"step_ms\": 0}, \"tool\"", 14, "solver.step_ms is 0", "0.1 to 50 ms"},
    {"\"nodes\"", "\"gravity_m_s2\": -9.81, \"nodes\"", 5, "body.lattice.gravity_m_s2 is a number", "a list"},
    {"\"nodes\"", "\"gravity_m_s2\": [0, 0, -981], \"nodes\"", 5, "body.lattice.gravity_m_s2[2] is -981", "m/s^2"},
    {"\"nodes\"", "\"spring_law\": \"cubic\", \"nodes\"", 5, "body.lattice.spring_law is \"cubic\"", "\"thigh-skin\""},
    {"\"nodes\"", "\"stiffening\": 3, \"nodes\"", 5, "body.lattice.stiffening is given", "only with spring_law"},
    {"\"nodes\"", "\"spring_law\": \"stiffening\", \"stiffening\": -3, \"nodes\"", 5, "body.lattice.stiffening is -3", "0 to 1"},
    {"\"nodes\"", "\"origin_m\": [0, 0, 99], \"nodes\"", 5, "body.lattice.origin_m[2] is 99", "-5 to 5 m"},
    {"\"nodes\"", "\"thickness_m\": 0.01, \"nodes\"", 5, "body.lattice.thickness_m", "only with nodes [nx, ny]"},
    {"\"nodes\"", "\"spacing_m\": 0.01, \"nodes\"", 5, "body.lattice.spacing_m", "or a clip"},
    {"\"nodes\"", "\"fixed_below_z_m\": 99, \"nodes\"", 5, "body.lattice.fixed_below_z_m is 99", "m"},
    {"\"nodes\"", "\"fixed_above_z_m\": -1, \"nodes\"", 4, "every node of the body is fixed", "some that can move"},
    {"[6, 6, 6]", "[6, 6]", 10, "body.lattice.fixed_faces[0] is \"z-\"", "for a sheet"},
    // misspelt
    {"\"name\"", "\"nmae\"", 2, "nmae is not a known field", "\"name\""},
    {"\"body\"", "\"boddy\"", 3, "boddy is not a known field", "\"body\""},
    {"\"lattice\"", "\"latice\"", 4, "body.latice", "\"lattice\""},
    {"\"nodes\"", "\"node\"", 5, "body.lattice.node is not", "\"nodes\""},
    {"\"size_m\"", "\"size\"", 6, "body.lattice.size is not", "\"size_m\""},
    {"\"density_kg_m3\"", "\"density_kg_m^3\"", 7, "density_kg_m^3", "\"density_kg_m3\""},
    {"\"stiffness_n_m\"", "\"stifness_n_m\"", 8, "stifness_n_m", "\"stiffness_n_m\""},
    {"\"damping_n_s_m\"", "\"damping_ns_m\"", 9, "damping_ns_m", "\"damping_n_s_m\""},
    {"\"fixed_faces\"", "\"fixed_face\"", 10, "fixed_face", "\"fixed_faces\""},
    {"\"below_z_m\"", "\"below_z\"", 11, "body.lattice.layers[0].below_z ", "\"below_z_m\""},
    {"\"contact\"", "\"contct\"", 14, "tool.contct", "\"contact\""},
    {"\"contact\"", "\"colour\"", 14, "tool.colour", "one of contact, node, mu, contact_stiffness_n_m, radius_m"},
    // missing
    {"\"nodes\": [6, 6, 6],", "", 4, "body.lattice.nodes is missing", "3 whole numbers"},
    {"\"size_m\": [0.1, 0.1, 0.1],", "", 4, "body.lattice.size_m is missing", "3 numbers"},
    {"\"stiffness_n_m\": 60,", "", 4, "body.lattice.stiffness_n_m is missing", "N/m"},
    {"\"damping_n_s_m\": 0.24,", "", 4, "body.lattice.damping_n_s_m is missing", "N s/m"},
    // wrong type
    {"\"cube6\"", "6", 2, "name is a number", "a text"},
    {"[6, 6, 6]", "6", 5, "body.lattice.nodes is a number", "a list"},
    {"60,", "\"60\",", 8, "body.lattice.stiffness_n_m is a text", "a number"},
    {"60,", "null,", 8, "body.lattice.stiffness_n_m is null", "a number"},
    {"60,", "true,", 8, "body.lattice.stiffness_n_m is true or false", "a number"},
    {"60,", "NaN,", 8, "'NaN' is not a value", "a number"},
    {"[\"z-\"]", "[3]", 10, "body.lattice.fixed_faces[0] is a number", "a text"},
    {"{ \"contact\": \"attach\", \"node\": [2, 2, 5] }", "[]", 14, "tool is a list", "an object"},
    // malformed
    {"60,", "060,", 8, "'6' is out of place", "',' or '}'"},
    {"60,", "6.,", 8, "',' is out of place", "a digit"},
    {"60,", "60", 9, "'\"' is out of place", "',' or '}'"},
    {"\"damping_n_s_m\": 0.24,", "\"stiffness_n_m\": 0.24,", 9, "\"stiffness_n_m\" is given twice, first in line 8",
     "each field once"},
    {"[2, 2, 5] }", "[2, 2, 5], }", 14, "'}' is out of place", "a field name"},
    {"\"cube6\"", "\"\xff\xfe\"", 2, "UTF-8", "a scene"},
    {"\"cube6\"", "\"\\ud83d\"", 2, "surrogate", "UTF-8"},
    {"\"cube6\"", "\"\\q\"", 2, "unknown escape", "one of"},
    {"\"cube6\"", "\"cube6", 2, "a text does not end", "double quote"},
};

TEST_CASE("Every mistake in a scene is answered with file, line, field and what was expected", "[scene]") {
  const Folder folder;
  REQUIRE(error_of(folder, kSoftCube).empty());
  for (const Mistake& m : kMistakes) {
    const std::string message = error_of(folder, replaced(kSoftCube, m.from, m.to));
    INFO(m.from << " -> " << m.to << "\n" << message);
    CHECK(message.find("scene.json:" + std::to_string(m.line) + ": ") != std::string::npos);
    CHECK(message.find(m.field) != std::string::npos);
    CHECK(message.find("; expected ") != std::string::npos);
    CHECK(message.find(m.expected, message.find("; expected ")) != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
  }
}

TEST_CASE("A scene cut off anywhere is refused with a line", "[scene]") {
  const Folder folder;
  const std::string text = kSoftCube;
  for (std::size_t n = 0; n + 2 < text.size(); ++n) {
    const std::string message = error_of(folder, text.substr(0, n));
    INFO(n << ": " << message);
    CHECK(message.find("scene.json:") != std::string::npos);
    CHECK(message.find("; expected ") != std::string::npos);
  }
}

TEST_CASE("Nesting without end is refused, not followed", "[scene]") {
  CHECK(error_of(Folder(), std::string(100000, '[')).find("nested too deep") != std::string::npos);
}

TEST_CASE("A scene that is not there, or a folder, is refused by name", "[scene]") {
  const Folder folder;
  CHECK_THROWS_WITH(load_scene(folder / "none.json"),
                    Catch::Contains("none.json: cannot be read (No such file or directory); expected a scene file"));
  CHECK_THROWS_AS(load_scene(folder / "."), InputError);
}

TEST_CASE("A sheet refuses what needs depth", "[scene]") {
  const Folder folder;
  const std::string sheet = R"({"body": {"lattice": {"nodes": [5, 5], "size_m": [0.1, 0.1],
    "stiffness_n_m": 60, "damping_n_s_m": 0.1, "fixed_faces": ["y-"]}},
    "tool": {"contact": "attach"}})";
  REQUIRE(error_of(folder, sheet).empty());
  CHECK(error_of(folder, replaced(sheet, "y-", "z-")).find("\"y+\" for a sheet") != std::string::npos);
  CHECK(error_of(folder, replaced(sheet, "attach", "touch")).find("scene.json:3: the tool touches a sheet") != std::string::npos);
  CHECK(error_of(folder, replaced(sheet, "\"size_m\"",
                                  "\"clip\": {\"ellipsoids\": [{\"center_m\": [0,0,0], \"radii_m\": [1,1,1]}]}, \"size_m\""))
            .find("clip is given for a sheet") != std::string::npos);
  CHECK(error_of(folder, replaced(sheet, "\"size_m\"", "\"thickness_m\": 0, \"size_m\"")).find("thickness_m is 0") !=
        std::string::npos);
}

}  // namespace
}  // namespace palpate
