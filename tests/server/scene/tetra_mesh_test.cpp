// Meshes of tetrahedra from files of Gmsh and VTK.
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <numeric>

#include "scene_files.hpp"
#include "server/scene/surface.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {
namespace {

using test::error_of;
using test::Folder;
using test::replaced;
using test::volume;

/// A cube of 20 mm as six tetrahedra around its diagonal, in the two formats.
const std::string kMsh2 = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
8
11 0 0 0
12 20 0 0
13 0 20 0
14 20 20 0
15 0 0 20
16 20 0 20
17 0 20 20
18 20 20 20
$EndNodes
$Elements
8
1 15 2 7 1 11
2 2 2 7 1 11 12 14
3 4 2 3 1 11 12 14 18
4 4 2 3 1 11 12 18 16
5 4 2 3 1 11 13 18 14
6 4 2 3 1 11 13 17 18
7 4 2 5 1 11 15 16 18
8 4 2 5 1 11 15 18 17
$EndElements
)";

const std::string kMsh4 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
1 0 1 2
1 0 0 0 0
5 0 0 0 20 20 0 0 0
1 0 0 0 20 20 20 1 3 1 5
2 0 0 0 20 20 20 1 5 0
$EndEntities
$Nodes
2 8 11 18
2 5 0 3
11
12
13
0 0 0
20 0 0
0 20 0
3 1 0 5
14
15
16
17
18
20 20 0
0 0 20
20 0 20
0 20 20
20 20 20
$EndNodes
$Elements
3 7 1 7
2 5 2 1
1 11 12 14
3 1 4 4
2 11 12 14 18
3 11 12 18 16
4 11 13 18 14
5 11 13 17 18
3 2 4 2
6 11 15 16 18
7 11 15 18 17
$EndElements
)";

const std::string kVtk = R"(# vtk DataFile Version 3.0
a cube
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 9 double
0 0 0 20 0 0 0 20 0 20 20 0 0 0 20 20 0 20 0 20 20 20 20 20 5 5 5
CELLS 7 34
3 0 1 3
4 0 1 3 7
4 0 1 7 5
4 0 2 7 3
4 0 2 6 7
4 0 4 5 7
4 0 4 7 6
CELL_TYPES 7
5 10 10 10 10 10 10
CELL_DATA 7
SCALARS region int 1
LOOKUP_TABLE default
9 3 3 3 3 5 5
)";

const std::string kVtk5 = R"(# vtk DataFile Version 5.1
a cube
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 float
0 0 0 20 0 0 0 20 0 20 20 0 0 0 20 20 0 20 0 20 20 20 20 20
CELLS 7 24
OFFSETS vtktypeint64
0 4 8 12 16 20 24
CONNECTIVITY vtktypeint64
0 1 3 7 0 1 7 5 0 2 7 3 0 2 6 7 0 4 5 7 0 4 7 6
CELL_TYPES 6
10 10 10 10 10 10
CELL_DATA 6
SCALARS region int
LOOKUP_TABLE default
3 3 3 3 5 5
)";

std::string mesh_scene(const std::string& file) {
  return R"({"body": {"mesh": {"file": ")" + file +
         R"(", "scale": 0.001, "density_kg_m3": 1000, "fixed_faces": ["z-"],
  "solid": {"young_pa": 5000}, "regions": [{"id": 5, "young_pa": 900, "poisson": 0.3}]}}})";
}

TEST_CASE("A mesh from a file is of tetrahedra, and another element is refused for it", "[scene][solid]") {
  const Folder folder;
  folder.write("a.msh", kMsh2);
  const std::string scene = mesh_scene("a.msh");
  const std::string other = replaced(scene, "{\"young_pa\": 5000}", "{\"element\": \"hexahedron\", \"young_pa\": 5000}");
  CHECK(error_of(folder, other).find("body.mesh.solid.element is \"hexahedron\"") != std::string::npos);
}

TEST_CASE("Meshes of tetrahedra are read from Gmsh and VTK files of either version, with their regions", "[scene][solid]") {
  const Folder folder;
  const std::string of_meshio = replaced(kVtk, "SCALARS region", "SCALARS gmsh:physical");
  const std::string of_gmsh = replaced(kVtk, "SCALARS region", "SCALARS CellEntityIds");
  for (const auto& [name, text] : {std::pair{"a.msh", kMsh2},
                                   {"b.msh", kMsh4},
                                   {"c.vtk", kVtk},
                                   {"d.vtk", kVtk5},
                                   {"e.vtk", of_meshio},
                                   {"f.vtk", of_gmsh}}) {
    INFO(name);
    folder.write(name, text);
    const auto body = load_scene(folder.write("scene.json", mesh_scene(name))).body;
    CHECK(body.nodes.size() == 8);
    REQUIRE(body.tetrahedra.size() == 6);
    CHECK(volume(body) == Approx(8e-6));
    for (const Tetrahedron& t : body.tetrahedra) CHECK(volume_of(t, body.nodes) > 0);
    CHECK(body.materials[body.tetrahedra[0].material].young_pa == 5000);
    CHECK(body.materials[body.tetrahedra[5].material].young_pa == 900);
    CHECK(check_edges(body.triangles).closed());
    CHECK(signed_volume(body.triangles, body.nodes) == Approx(8e-6));
    CHECK(std::accumulate(body.fixed.begin(), body.fixed.end(), 0) == 4);
    CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(8e-3));
  }
}

TEST_CASE("A region that a mesh does not have is refused with those that it has", "[scene][solid]") {
  const Folder folder;
  folder.write("a.msh", kMsh2);
  const std::string said = error_of(folder, replaced(mesh_scene("a.msh"), R"("id": 5)", R"("id": 6)"));
  CHECK(said.find("which no tetrahedron has; expected a region of the mesh: 3, 5") != std::string::npos);
}

TEST_CASE("Mixed cells become tetrahedra whose faces match, in whatever order they name their corners", "[scene][solid]") {
  const Folder folder;
  // A cube, next to it a prism and a pyramid, and a tetrahedron on the pyramid: 8 + 4 + 8/3 + 4/3 mm^3.
  const std::string cells = R"(# vtk DataFile Version 3.0
mixed
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 12 double
0 0 0 2 0 0 2 2 0 0 2 0 0 0 2 2 0 2 2 2 2 0 2 2 4 0 0 4 0 2 1 1 4 1 3 4
CELLS 4 25
8 0 1 2 3 4 5 6 7
6 1 8 2 5 9 6
5 4 5 6 7 10
4 6 7 10 11
CELL_TYPES 4
12 13 14 10
)";
  for (const std::string& text : {cells, replaced(cells, "8 0 1 2 3 4 5 6 7", "8 2 6 5 1 3 7 4 0")}) {
    folder.write("c.vtk", text);
    const auto body = load_scene(folder.write("scene.json", replaced(mesh_scene("c.vtk"), R"("id": 5)", R"("id": 0)"))).body;
    CHECK(body.nodes.size() == 12);
    CHECK(volume(body) == Approx((8 + 4 + 8.0 / 3 + 4.0 / 3) * 1e-9));
    CHECK(check_edges(body.triangles).closed());
    CHECK(signed_volume(body.triangles, body.nodes) == Approx(volume(body)));
  }
}

TEST_CASE("A volume in two groups, whose elements a file has twice, is read once with the first", "[scene][solid]") {
  const Folder folder;
  std::string twice = replaced(kMsh2, "$Elements", "$Elements ");
  const auto begin = twice.find('\n', twice.find("$Elements")) + 1, end = twice.find("$EndElements");
  const std::string list = twice.substr(twice.find('\n', begin) + 1, end - twice.find('\n', begin) - 1);
  const int count = std::stoi(twice.substr(begin));
  twice.replace(begin, end - begin, std::to_string(2 * count) + "\n" + list + list);
  folder.write("a.msh", twice);
  const auto body = load_scene(folder.write("scene.json", mesh_scene("a.msh"))).body;
  CHECK(body.tetrahedra.size() == 6);
  CHECK(volume(body) == Approx(8e-6));
  CHECK(body.materials[body.tetrahedra[5].material].young_pa == 900);
}

TEST_CASE("Regions of VTK files are read from FIELD arrays as well, among others", "[scene][solid]") {
  const Folder folder;
  const auto at = kVtk.find("SCALARS");
  const std::string numbers = kVtk.substr(kVtk.find("default") + 7);
  folder.write("f.vtk", kVtk.substr(0, at) + "FIELD FieldData 2\nquality 2 7 double\n1 2 3 4 5 6 7 8 9 10 11 12 13 14\n" +
                            "METADATA\nINFORMATION 0\n\nregion 1 7 int" + numbers);
  const auto body = load_scene(folder.write("scene.json", mesh_scene("f.vtk"))).body;
  CHECK(body.materials[body.tetrahedra[0].material].young_pa == 5000);
  CHECK(body.materials[body.tetrahedra[5].material].young_pa == 900);
}

TEST_CASE("Parts that hang together by a node or an edge alone are refused where one of them is not held", "[scene][solid]") {
  const Folder folder;
  const std::string hinge = R"(# vtk DataFile Version 3.0
hinge
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 7 double
0 0 0 1 0 0 0 1 0 0.3 0.3 1 0 0 2 1 0 2 0.3 1 2
CELLS 2 10
4 0 1 2 3
4 3 4 6 5
CELL_TYPES 2
10 10
)";
  const auto scene = [](const char* held) {
    return std::string(R"({"body": {"mesh": {"file": "h.vtk", "scale": 0.1, "solid": {"young_pa": 5000}, )") + held + "}}}";
  };
  folder.write("h.vtk", hinge);
  CHECK_THAT(error_of(folder, scene(R"("fixed_below_z_m": 0.01)")),
             Catch::Contains("2 parts that hang together by nodes or edges alone") && Catch::Contains("1 are not held"));
  CHECK(load_scene(folder.write("scene.json", scene(R"("fixed_below_z_m": 0.01, "fixed_above_z_m": 0.19)"))).body.nodes.size() ==
        7);
}

/// A column of 20 cubes of 10 mm, of six tetrahedra each, and one flat tetrahedron: between the tenth and the eleventh, which cut
/// the face that they share along different diagonals, or on top.
std::string column(bool flat_between, bool upper_mirrored) {
  std::string text = "# vtk DataFile Version 3.0\na column\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 84 double\n";
  for (int k = 0; k <= 20; ++k)
    for (int c = 0; c < 4; ++c)
      text += std::to_string(c % 2 * 10) + " " + std::to_string(c / 2 * 10) + " " + std::to_string(10 * k) + "\n";
  std::string cells;
  const auto add = [&](std::array<int, 4> nodes) {
    cells += "4";
    for (const int node : nodes) cells += " " + std::to_string(node);
    cells += "\n";
  };
  for (int k = 0; k < 20; ++k) {
    const int mirror = k >= 10 && upper_mirrored ? 1 : 0;  // of x
    const auto node = [&](int b) { return 4 * (k + (b >> 2)) + ((b & 3) ^ mirror); };
    for (const auto& [a, b] : {std::pair{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}})
      add({node(0), node(a), node(b), node(7)});
  }
  const int first = flat_between ? 40 : 80;
  add({first, first + 1, first + 2, first + 3});
  text += "CELLS 121 605\n" + cells + "CELL_TYPES 121\n";
  for (int i = 0; i < 121; ++i) text += "10\n";
  return text;
}

TEST_CASE("Few tetrahedra without volume are left out of a mesh, inside and on its surface, and the rest is as without them",
          "[scene][solid]") {
  const Folder folder;
  const std::string scene = R"({"body": {"mesh": {"file": "column.vtk", "scale": 0.001, "density_kg_m3": 1000,
    "fixed_faces": ["z-"], "solid": {"young_pa": 5000}}}})";
  for (const bool between : {false, true}) {
    folder.write("column.vtk", column(between, between));
    const LumpedBody body = load_scene(folder.write("column.json", scene)).body;
    CHECK(body.tetrahedra.size() == 120);
    CHECK(body.triangles.size() == 2 * (4 * 20 + 2));
    CHECK(signed_volume(body.triangles, body.nodes) == Approx(0.01 * 0.01 * 0.2));
    CHECK(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0) == Approx(0.01 * 0.01 * 0.2 * 1000));
  }
  folder.write("column.vtk", replaced(column(false, false), "4 80 81 82 83", "4 80 81 83 83"));
  CHECK(load_scene(folder.write("column.json", scene)).body.tetrahedra.size() == 120);
}

TEST_CASE("What is wrong with a mesh is said with its place and what was expected", "[scene][solid]") {
  const Folder folder;
  const auto mesh_error = [&](const std::string& name, const std::string& text) {
    folder.write(name, text);
    return error_of(folder, mesh_scene(name));
  };
  using Catch::Contains;
  CHECK_THAT(mesh_error("old.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n"),
             Contains("version 1 of the Gmsh format") && Contains("version 2.2 or 4.1"));
  CHECK_THAT(mesh_error("bare.msh", "$Nodes\n1\n1 0 0 0\n$EndNodes\n"), Contains("before $MeshFormat"));
  CHECK_THAT(error_of(folder, mesh_scene("none.msh")), Contains("none.msh") && Contains("cannot be read"));
  CHECK_THAT(error_of(folder, mesh_scene("none.stl")), Contains("FILE.msh or FILE.vtk"));
  CHECK_THAT(mesh_error("a.msh", replaced(kMsh2, "2.2 0 8", "2.2 1 8")), Contains("a.msh:2") && Contains("binary"));
  CHECK_THAT(mesh_error("a.msh", replaced(kMsh2, "2.2 0", "3.0 0")), Contains("2.2 or 4.1"));
  CHECK_THAT(mesh_error("a.msh", replaced(kMsh2, "12 20 0 0", "12 20 x 0")), Contains("a.msh:7") && Contains("a number"));
  CHECK_THAT(mesh_error("a.msh", replaced(kMsh2, "12 14 18", "12 14 19")), Contains("node that is not there"));
  CHECK_THAT(mesh_error("a.msh", kMsh2.substr(0, kMsh2.size() - 20)), Contains("ends too early"));
  CHECK_THAT(mesh_error("a.msh", replaced(kMsh2, "14 20 20 0", "14 10 0 0")), Contains("1 of 6 tetrahedra (17 %) is flat"));
  CHECK_THAT(mesh_error("a.vtk", replaced(kVtk, "ASCII", "BINARY")), Contains("text file"));
  CHECK_THAT(mesh_error("a.vtk", replaced(kVtk, "UNSTRUCTURED_GRID", "POLYDATA")), Contains("UNSTRUCTURED_GRID"));
  CHECK_THAT(mesh_error("a.vtk", replaced(kVtk, "5 10 10 10 10 10 10", "5 5 5 5 5 5 5")), Contains("no tetrahedra"));
  CHECK_THAT(mesh_error("a.vtk", replaced(kVtk, "9 3 3 3 3 5 5", "9 3 3 3 3 3 3")), Contains("regions[0].id is 5"));
  CHECK_THAT(error_of(folder, replaced(mesh_scene("c.vtk"), "{\"mesh\"", "{\"lattice\": {}, \"mesh\"")),
             Contains("lattice or a mesh"));
}

TEST_CASE("A scene with a mesh is printed so that it reads back to the same", "[scene][solid]") {
  const Folder folder;
  folder.write("c.vtk", kVtk);
  const std::string once = print_scene(folder.write("mesh.json", mesh_scene("c.vtk")));
  CHECK(print_scene(folder.write("again.json", once)) == once);
}

}  // namespace
}  // namespace palpate
