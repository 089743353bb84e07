// Malicious files: a number in them does not determine an allocation, a name in them opens no other folder, and a message
// explains it.
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>

#include "common/base/error.hpp"
#include "scene_files.hpp"
#include "tests/support/address_space.hpp"

namespace palpate {
namespace {

using test::AddressSpace;
using test::Folder;
using test::replaced;

constexpr std::size_t kFew = 64u << 20;  ///< bytes that a reader of a small file may allocate

const char* const kClipScene = R"({ "body": { "lattice": { "spacing_m": 0.01, "clip": { "mesh": { "file": "FILE" } },
  "density_kg_m3": 1000, "stiffness_n_m": 25, "damping_n_s_m": 0.1 } } })";
const char* const kTetraScene = R"({ "body": { "mesh": { "file": "FILE", "solid": { "young_pa": 1000 } } } })";

/// A tetrahedron of a tenth of a metre, in the given region.
std::string gmsh_of(const std::string& region) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 0.1 0 0\n3 0 0.1 0\n4 0 0 0.1\n$EndNodes\n"
         "$Elements\n1\n1 4 2 " +
         region + " 1 1 2 3 4\n$EndElements\n";
}

std::string error_of(const Folder& folder, const char* scene, const std::string& file, const std::string& bytes) {
  folder.write(file, bytes);
  const AddressSpace no_more(kFew);
  return test::error_of(folder, replaced(scene, "FILE", file));
}

void check_words(const std::string& message, const char* words) {
  INFO(message);
  CHECK(message.find(words) != std::string::npos);
  CHECK(message.find("; expected ") != std::string::npos);
  CHECK(message.find('\n') == std::string::npos);
}

TEST_CASE("A count in a mesh file that the file has no room for is refused before memory is taken", "[scene][hostile]") {
  const Folder folder;
  const std::string vtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  const std::string vtk5 = "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  check_words(error_of(folder, kTetraScene, "a.vtk",
                       vtk5 + "CELLS 4 60000000\nOFFSETS vtktypeint64\n0 1 2 3\nCONNECTIVITY vtktypeint64\n"),
              "60000000");
  check_words(error_of(folder, kTetraScene, "a.vtk", vtk + "CELL_TYPES 4000000\n10\n"), "4000000");
  check_words(error_of(folder, kTetraScene, "a.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1 1 1\n3 1 0 1000000\n1\n"),
              "1000000");
}

TEST_CASE("A region of a mesh may have any number", "[scene][hostile]") {
  const Folder folder;
  CHECK(error_of(folder, kTetraScene, "a.msh", gmsh_of("2000000000")).empty());
}

TEST_CASE("Whatever lies beyond the world is refused, not computed with", "[scene][hostile]") {
  const Folder folder;
  check_words(error_of(folder, kTetraScene, "a.msh", replaced(gmsh_of("1"), "0.1 0 0", "1e308 0 0")), "has a vertex at");
  auto ball = test::icosphere(1, 0.05);
  for (Vec3& v : ball.vertices) v[0] += 40;
  check_words(error_of(folder, kClipScene, "a.obj", test::as_obj(ball)), "has a vertex at");
  for (Vec3& v : ball.vertices) v[0] += 1e300;
  check_words(error_of(folder, kClipScene, "a.obj", test::as_obj(ball)), "a coordinate of ");
}

TEST_CASE("A face of a million corners is refused at its first too many", "[scene][hostile]") {
  const Folder folder;
  std::string obj = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf";
  for (int i = 0; i < 1'000'000; ++i) (obj += ' ') += "123"[i % 3];
  check_words(error_of(folder, kClipScene, "a.obj", obj), "a face has too many corners; expected at most 1000");
}

TEST_CASE("An STL file that says more triangles than it has is refused", "[scene][hostile]") {
  const Folder folder;
  std::string stl = as_stl(test::icosphere(1, 0.05));
  for (std::size_t byte = 80; byte < 84; ++byte) stl[byte] = '\x7f';
  check_words(error_of(folder, kClipScene, "a.stl", stl), "ends too early");
}

TEST_CASE("A binary STL file with a corner that is no number is refused", "[scene][hostile]") {
  const Folder folder;
  for (const std::uint32_t bits : {0x7fc00000u, 0xffc00000u, 0x7f800000u}) {
    std::string stl = as_stl(test::icosphere(1, 0.05));
    for (std::size_t corner = 0; corner < 3; ++corner) {
      std::string bad = stl;
      std::memcpy(bad.data() + 84 + 12 + 12 * corner + 4, &bits, sizeof bits);
      check_words(error_of(folder, kClipScene, "a.stl", bad), "triangle 0 has a corner that is nowhere");
    }
  }
}

TEST_CASE("A scene names meshes of its own folder, and of others that are allowed, by whatever way it names them",
          "[scene][hostile]") {
  const Folder folder;
  const auto inside = folder / "scenes", outside = folder / "elsewhere";
  std::filesystem::create_directories(inside / "meshes");
  std::filesystem::create_directories(outside);
  folder.write("scenes/meshes/a.msh", gmsh_of("1"));
  folder.write("elsewhere/a.msh", gmsh_of("1"));
  std::filesystem::create_symlink(outside, inside / "link");
  const auto naming = [&](const std::string& mesh) { return folder.write("scenes/s.json", replaced(kTetraScene, "FILE", mesh)); };
  for (const std::string& mesh :
       {std::string("meshes/a.msh"), std::string("./meshes/../meshes/a.msh"), (inside / "meshes/a.msh").string()})
    CHECK_NOTHROW(load_scene(naming(mesh)));
  for (const std::string& mesh : {std::string("../elsewhere/a.msh"), (outside / "a.msh").string(), std::string("link/a.msh")}) {
    INFO(mesh);
    const auto scene = naming(mesh);
    CHECK_NOTHROW(load_scene(scene, {outside}));
    CHECK_THROWS_AS(load_scene(scene, {folder / "els"}), InputError);
    try {
      load_scene(scene);
      FAIL("a mesh outside of the scene's folder was opened");
    } catch (const InputError& error) {
      check_words(error.what(), "s.json:1: body.mesh.file is ");
      check_words(error.what(), ("--mesh-folder \"" + std::filesystem::canonical(outside).string().substr(0, 20)).c_str());
    }
  }
}

TEST_CASE("A mesh that is not there is said to be missing, not to lie elsewhere, from whatever folder its scene is named",
          "[scene]") {
  const Folder folder;
  folder.write("s.json", replaced(kTetraScene, "FILE", "none.msh"));
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder / ".");
  for (const std::string& scene : {std::string("s.json"), std::string("./s.json"), (folder / "s.json").string()}) {
    CAPTURE(scene);
    try {
      load_scene(scene);
      FAIL_CHECK("a mesh that is not there was opened");
    } catch (const InputError& error) {
      check_words(error.what(), "none.msh");
      check_words(error.what(), "cannot be read");
    }
  }
  std::filesystem::current_path(before);
}

TEST_CASE("A scene that came with its own file name opens no mesh unless its folder is allowed", "[scene][hostile]") {
  const Folder folder;
  folder.write("a.msh", gmsh_of("1"));
  const std::string scene = replaced(kTetraScene, "FILE", "a.msh"), name = (folder / "s.json").string();
  CHECK_THROWS_AS(read_scene(scene, name), InputError);
  CHECK_NOTHROW(read_scene(scene, name, {folder / "."}));
}

TEST_CASE("What a file says reaches a message short, on one line and without control characters", "[scene][hostile]") {
  const Folder folder;
  const std::string escape = "\\u001b[2J", raw = "\x1b[2J\xff";
  for (const std::string& scene :
       {"{ \"" + escape + "\": 1 }", "{ \"name\": \"" + escape + "\" }", std::string("{ \xff }"),
        "{ \"a\": 1, \"a\": " + escape + " }", "{ \"" + std::string(100'000, 'x') + "\": 1 }",
        "{ \"body\": " + std::string(100'000, '9') + " }", replaced(kTetraScene, "FILE", "a\\u0000.msh")}) {
    const std::string message = test::error_of(folder, scene);
    check_words(message, "scene.json");
    CHECK(message.size() < 1000);
    CHECK(message.find_first_of("\x1b\xff") == std::string::npos);
  }
  for (const auto& [scene, file] :
       {std::pair{kTetraScene, "a.msh"}, {kTetraScene, "a.vtk"}, {kClipScene, "a.obj"}, {kClipScene, "a.stl"}}) {
    const std::string begin = std::string(file).ends_with("msh")   ? "$MeshFormat 2.2 0 8 $Nodes "
                              : std::string(file).ends_with("obj") ? "v "
                                                                   : "solid \n";
    const std::string message = error_of(folder, scene, file, begin + raw + std::string(10'000, 'x'));
    check_words(message, file);
    CHECK(message.size() < 1000);
    CHECK(message.find_first_of("\x1b\xff") == std::string::npos);
  }
}

TEST_CASE("A clip so small that it keeps a single loose cell keeps none, and is refused", "[scene][hostile]") {
  const Folder folder;
  const char* const scene = R"({ "body": { "lattice": { "nodes": [4, 4, 4], "size_m": [0.09, 0.09, 0.09],
    "clip": { "ellipsoids": [ { "center_m": [0.015, 0.015, 0.015], "radii_m": [0.01, 0.01, 0.01] } ] },
    "density_kg_m3": 1000, "stiffness_n_m": 25, "damping_n_s_m": 0.1 } } })";
  check_words(test::error_of(folder, scene), "no cell of the lattice lies inside the clip");
}

TEST_CASE("A scene of very many fields or bytes is refused soon", "[scene][hostile]") {
  const Folder folder;
  std::string many = "{ ";
  for (int i = 0; i < 100'000; ++i) many += "\"f" + std::to_string(i) + "\": 1, ";
  check_words(test::error_of(folder, many + "\"last\": 1 }"), "too many fields");
  check_words(test::error_of(folder, std::string(5u << 20, ' ') + "{}"), "is too long");
}

TEST_CASE("A mesh that is no plain file is not waited for", "[scene][hostile]") {
  const Folder folder;
  std::filesystem::create_symlink("/dev/zero", folder / "a.obj");
  folder.write("scene.json", replaced(kClipScene, "FILE", "a.obj"));
  CHECK_THROWS_WITH(load_scene(folder / "scene.json", {"/dev"}), Catch::Contains("cannot be read"));
}

}  // namespace
}  // namespace palpate
