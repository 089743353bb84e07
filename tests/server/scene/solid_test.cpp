// Bodies of finite elements: lattices filled with tetrahedra and hexahedra.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <numeric>

#include "scene_files.hpp"
#include "server/scene/hexa_mesh.hpp"
#include "server/scene/surface.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::replaced;
using test::volume;

const std::string kBlock = R"({"body": {"lattice": {
  "nodes": [4, 3, 5], "size_m": [0.06, 0.04, 0.08], "density_kg_m3": 1100, "fixed_faces": ["z-"],
  "solid": {"element": "tetrahedron", "law": "corotational", "young_pa": 5000, "poisson": 0.4, "damping_s": 0.02, "mass_damping_1_s": 1.5},
  "layers": [{"below_z_m": 0.04, "young_pa": 1000}]
}}})";

TEST_CASE("A box of finite elements has six tetrahedra a cell, a closed surface and its own volume and mass", "[scene][solid]") {
  const auto body = load_scene(Folder().write("block.json", kBlock)).body;
  CHECK(body.nodes.size() == 60);
  CHECK(body.elements.empty());
  CHECK(body.tetrahedra.size() == 6 * 3 * 2 * 4);
  for (const Tetrahedron& t : body.tetrahedra) CHECK(volume_of(t, body.nodes) == Approx(0.02 * 0.02 * 0.02 / 6));
  CHECK(check_edges(body.triangles).closed());
  CHECK(body.triangles.size() == 2 * 2 * (3 * 2 + 2 * 4 + 3 * 4));
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(0.06 * 0.04 * 0.08));
  CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(1100 * 0.06 * 0.04 * 0.08));
  CHECK(body.mass_damping_1_s == 1.5);
}

TEST_CASE("A box of hexahedra has one a cell, and surface, volume and mass of the box of tetrahedra", "[scene][solid]") {
  const auto split = load_scene(Folder().write("block.json", kBlock)).body;
  const auto body = load_scene(Folder().write("block.json", replaced(kBlock, "tetrahedron", "hexahedron"))).body;
  CHECK(body.tetrahedra.empty());
  REQUIRE(body.hexahedra.size() == 3 * 2 * 4);
  CHECK(body.triangles == split.triangles);
  for (const Hexahedron& h : body.hexahedra) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      CHECK((body.nodes[h.nodes[std::size_t{1} << axis]] - body.nodes[h.nodes[0]] -
             0.02 * Vec3::Unit(static_cast<Eigen::Index>(axis)))
                .norm() < 1e-12);
    CHECK(body.materials[h.material].young_pa == (centre_of(h, body.nodes).z() < 0.04 ? 1000 : 5000));
  }
  CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(1100 * 0.06 * 0.04 * 0.08));
  CHECK(body.masses_kg[0] == Approx(1100 * 0.02 * 0.02 * 0.02 / 8));
}

TEST_CASE("The organ of hexahedra has the mass of what is inside its surface", "[scene][solid]") {
  const std::filesystem::path scenes = PALPATE_SOURCE_DIR "/scenes";
  const Folder folder;
  std::ifstream in(scenes / "organ-solid.json");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto body = load_scene(folder.write("organ.json", replaced(text, "tetrahedron", "hexahedron"))).body;
  CHECK(body.hexahedra.size() == 1073);
  const double inside = std::abs(signed_volume(body.triangles, body.nodes));
  CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(1060 * inside).epsilon(0.005));
  for (const double mass_kg : body.masses_kg) CHECK(mass_kg > 0);
}

TEST_CASE("What a law has besides its moduli is asked for, and refused with another law", "[scene][solid]") {
  const Folder folder;
  const auto with = [&](const std::string& fields) { return replaced(kBlock, "\"law\": \"corotational\"", fields); };
  const auto error = [&](const std::string& fields) { return error_of(folder, with(fields)); };
  CHECK(error(R"("law": "mooney-rivlin")").find("second_share") != std::string::npos);
  CHECK(error(R"("law": "veronda-westmann")").find("exponent") != std::string::npos);
  CHECK(error(R"("law": "veronda-westmann", "exponent": 51)").find("exponent") != std::string::npos);
  CHECK(error(R"("law": "neo-hookean", "exponent": 2)").find("\"veronda-westmann\" alone") != std::string::npos);
  CHECK(error(R"("law": "veronda-westmann", "exponent": 2, "second_share": 0.1)").find("second_share") != std::string::npos);
  CHECK(error(R"("law": "ogden")").find("exponents") != std::string::npos);
  CHECK(error(R"("law": "ogden", "exponents": [2, 0.5], "second_share": 0.1)").find("exponents[1] is 0.5") != std::string::npos);
  CHECK(error(R"("law": "ogden", "exponents": [2, 3])").find("second_share") != std::string::npos);
  CHECK(error(R"("law": "ogden", "exponents": [2], "second_share": 0.1)").find("two exponents") != std::string::npos);
  CHECK(error(R"("law": "ogden", "exponents": [2, 4, 6], "second_share": 0.1)").find("exponents is [2, 4, 6]") !=
        std::string::npos);
  CHECK(error(R"("law": "ogden", "exponent": 2)").find("exponents, one or two") != std::string::npos);
  CHECK(error(R"("law": "neo-hookean", "exponents": [2])").find("\"ogden\" alone") != std::string::npos);
  const auto body = load_scene(folder.write("a.json", with(R"("law": "veronda-westmann", "exponent": 2.5)"))).body;
  for (const SolidMaterial& m : body.materials) {
    CHECK(m.law == SolidLaw::veronda_westmann);
    CHECK(m.shape == 2.5);
  }
}

TEST_CASE("Ogden's law and fibres are read, the direction as a unit vector, and fibres that point nowhere are refused",
          "[scene][solid]") {
  const Folder folder;
  const auto with = [&](const std::string& fields) { return replaced(kBlock, "\"law\": \"corotational\"", fields); };
  const auto error = [&](const std::string& fields) { return error_of(folder, with(fields)); };
  const auto body = load_scene(folder.write("o.json", with(R"("law": "ogden", "exponents": [4, -3], "second_share": 0.25,
      "fibres": {"direction": [0, 3, 4], "stiffness_ratio": 2, "exponent": 1.5})")))
                        .body;
  for (const SolidMaterial& m : body.materials)
    CHECK(m.parameters() == LawParameters{SolidLaw::ogden, 0.25, {4, -3}, {{0, 0.6, 0.8}, 2, 1.5}});
  const auto one = load_scene(folder.write("p.json", with(R"("law": "ogden", "exponents": [-4.7])"))).body;
  CHECK(one.materials.front().parameters() == LawParameters{SolidLaw::ogden, 0, {-4.7, -4.7}, {}});
  CHECK(error(R"("law": "neo-hookean", "fibres": {"direction": [0, 0, 0], "stiffness_ratio": 1})").find("direction") !=
        std::string::npos);
  CHECK(error(R"("law": "neo-hookean", "fibres": {"direction": [1, 0, 0]})").find("stiffness_ratio") != std::string::npos);
}

TEST_CASE("A capsule puts a membrane on every triangle of the surface that is not held, its stiffness by its thickness",
          "[scene][solid]") {
  const Folder folder;
  const auto with = [&](const std::string& fields) {
    return replaced(kBlock, "\"law\": \"corotational\"", "\"law\": \"corotational\", \"capsule\": {" + fields + "}");
  };
  const auto bare = load_scene(folder.write("b.json", kBlock)).body;
  const auto body = load_scene(folder.write("c.json", with(R"("young_pa": 1e6, "thickness_m": 1e-4)"))).body;
  CHECK(body.masses_kg == bare.masses_kg);
  CHECK(body.materials.size() == bare.materials.size() + 1);
  CHECK(body.materials.back().law == SolidLaw::membrane);
  CHECK(body.materials.back().young_pa == Approx(100));
  std::size_t held = 0;
  for (const Triangle& t : body.triangles) held += body.fixed[t[0]] && body.fixed[t[1]] && body.fixed[t[2]];
  CHECK(held > 0);
  CHECK(body.tetrahedra.size() == bare.tetrahedra.size() + body.triangles.size() - held);
  CHECK(body.tetrahedra.back().is_triangle());
  CHECK(error_of(folder, with(R"("young_pa": 1e6)")).find("capsule.thickness_m") != std::string::npos);
  CHECK(error_of(folder, with(R"("young_pa": 1e6, "thickness_m": 0.1)")).find("capsule.thickness_m") != std::string::npos);
}

TEST_CASE("Stress that fades is read branch by branch, and makes of the material of slow motions that of fast ones",
          "[scene][solid]") {
  const Folder folder;
  const auto with = [&](const std::string& branches) {
    return replaced(kBlock, "\"law\": \"corotational\"", "\"law\": \"corotational\", \"relaxation\": [" + branches + "]");
  };
  const auto error = [&](const std::string& branches) { return error_of(folder, with(branches)); };
  const auto slow = load_scene(folder.write("slow.json", with(""))).body;
  const auto body =
      load_scene(folder.write("a.json", with(R"({"share": 0.3, "time_s": 0.5}, {"share": 0.2, "time_s": 50})"))).body;
  CHECK(slow.relaxation.empty());
  REQUIRE(body.relaxation.size() == 2);
  CHECK(body.relaxation[0].share == 0.3);
  CHECK(body.relaxation[1].time_s == 50);
  for (std::size_t k = 0; k < body.materials.size(); ++k)
    CHECK(body.materials[k].young_pa == Approx(slow.materials[k].young_pa / 0.5));
  CHECK(error(R"({"share": 0.3})").find("relaxation[0].time_s") != std::string::npos);
  CHECK(error(R"({"share": 0.3, "time_s": 0.001})").find("relaxation[0].time_s is 0.001") != std::string::npos);
  CHECK(error(R"({"share": 0.6, "time_s": 1}, {"share": 0.4, "time_s": 2})").find("shares of 1 together") != std::string::npos);
  const std::string one = R"({"share": 0.1, "time_s": 1})";
  CHECK(error(one + "," + one + "," + one + "," + one + "," + one).find("at most 4 branches") != std::string::npos);
}

TEST_CASE("A layer of a solid changes what it names and keeps the rest", "[scene][solid]") {
  const auto body = load_scene(Folder().write("block.json", kBlock)).body;
  std::size_t soft = 0;
  for (const Tetrahedron& t : body.tetrahedra) {
    const bool below = centre_of(t, body.nodes).z() < 0.04;
    const SolidMaterial& m = body.materials[t.material];
    CHECK(m.young_pa == (below ? 1000 : 5000));
    CHECK(m.poisson == 0.4);
    CHECK(m.damping_s == 0.02);
    CHECK(m.law == SolidLaw::corotational);
    soft += below;
  }
  CHECK(soft == body.tetrahedra.size() / 2);
}

TEST_CASE("The organ can be of finite elements, and keeps its shape", "[scene][solid]") {
  const std::filesystem::path scenes = PALPATE_SOURCE_DIR "/scenes";
  const auto springs = load_scene(scenes / "organ-buckling.json").body, solid = load_scene(scenes / "organ-solid.json").body;
  REQUIRE(solid.nodes.size() == springs.nodes.size());
  double apart = 0;  // largest move of nodes held back for the sake of the tetrahedra
  for (std::size_t i = 0; i < solid.nodes.size(); ++i) apart = std::max(apart, (solid.nodes[i] - springs.nodes[i]).norm());
  CHECK(apart < 0.0051);  // half a spacing
  CHECK(check_edges(solid.triangles).closed());
  CHECK(volume(solid) == Approx(signed_volume(springs.triangles, springs.nodes)).epsilon(0.02));
  for (const Tetrahedron& t : solid.tetrahedra) CHECK(quality_of(t, solid.nodes) >= 0.15);
}

TEST_CASE("What is wrong with a solid is said with its place and what was expected", "[scene][solid]") {
  const Folder folder;
  using Catch::Contains;
  CHECK_THAT(error_of(folder, replaced(kBlock, "tetrahedron", "brick")), Contains("expected \"hexahedron\" or \"tetrahedron\""));
  CHECK_THAT(error_of(folder, replaced(kBlock, "0.4,", "0.5,")),
             Contains("body.lattice.solid.poisson is 0.5") && Contains("0.499"));
  CHECK_THAT(error_of(folder, replaced(kBlock, "\"young_pa\": 5000, ", "")), Contains("body.lattice.solid.young_pa"));
  CHECK_THAT(error_of(folder, replaced(kBlock, "\"solid\"", "\"stiffness_n_m\": 3, \"solid\"")), Contains("given with solid"));
  CHECK_THAT(error_of(folder, replaced(kBlock, "\"young_pa\": 1000", "\"stiffness_n_m\": 1")), Contains("springs in a solid"));
}

TEST_CASE("A scene of finite elements is printed so that it reads back to the same", "[scene][solid]") {
  const Folder folder;
  const std::string once = print_scene(folder.write("block.json", kBlock));
  CHECK(print_scene(folder.write("again.json", once)) == once);
}

}  // namespace
}  // namespace palpate
