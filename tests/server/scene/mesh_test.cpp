// Mesh files, good and bad, all made here.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "scene_files.hpp"
#include "server/scene/clip.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/surface.hpp"
#include "tests/support/box_mesh.hpp"

namespace palpate {
namespace {

using test::Folder;
using test::icosphere;
using test::replaced;

const char* const kMeshScene = R"({
  "body": {
    "lattice": {
      "spacing_m": 0.01,
      "clip": { "mesh": { "file": "ball.obj" } },
      "density_kg_m3": 1000, "stiffness_n_m": 25, "damping_n_s_m": 0.1, "fixed_faces": ["z-"] } } }
)";

constexpr double kRadius = 0.05;
const double kBallVolume = 4 * std::acos(-1.0) / 3 * std::pow(kRadius, 3);

LumpedBody load(const Folder& folder, const std::string& text = kMeshScene) {
  return load_scene(folder.write("scene.json", text)).body;
}

TEST_CASE("The icosphere of these tests is a closed sphere", "[scene]") {
  const auto ball = icosphere(3, kRadius);
  CHECK(ball.triangles.size() == 20 * 64);
  CHECK(check_edges(ball.triangles).closed());
  CHECK(signed_volume(ball.triangles, ball.vertices) == Approx(kBallVolume).epsilon(0.02));
}

TEST_CASE("A ball from OBJ, ASCII STL and binary STL gives the same body", "[scene]") {
  const Folder folder;
  const auto ball = icosphere(3, kRadius);
  folder.write("ball.obj", test::as_obj(ball));
  folder.write("text.stl", test::as_ascii_stl(ball));
  folder.write("binary.STL", as_stl(ball));
  const LumpedBody obj = load(folder);
  CHECK(check_edges(obj.triangles).closed());
  CHECK(signed_volume(obj.triangles, obj.nodes) == Approx(kBallVolume).epsilon(0.05));
  for (const char* name : {"text.stl", "binary.STL"}) {
    const LumpedBody other = load(folder, replaced(kMeshScene, "ball.obj", name));
    REQUIRE(other.nodes.size() == obj.nodes.size());
    for (std::size_t i = 0; i < obj.nodes.size(); ++i) CHECK((obj.nodes[i] - other.nodes[i]).norm() < 1e-5);
  }
}

TEST_CASE("Scale, rotation and offset put a mesh in its place", "[scene]") {
  const Folder folder;
  auto ball = icosphere(3, 1);
  for (Vec3& v : ball.vertices) v = v.cwiseProduct(Vec3(1, 1, 2));  // long in z, in metres; the file is in decimetres
  folder.write("ball.obj", test::as_obj(ball, 10));
  const auto body =
      load(folder, replaced(kMeshScene, "\"ball.obj\"",
                            "\"ball.obj\", \"scale\": 0.005, \"rotation_deg\": [0, 90, 0], \"offset_m\": [0.3, 0, 0]"));
  Vec3 low = body.nodes[0], high = body.nodes[0];
  for (const Vec3& x : body.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  CHECK((low - Vec3(0.2, -0.05, -0.05)).norm() < 0.004);
  CHECK((high - Vec3(0.4, 0.05, 0.05)).norm() < 0.004);
}

TEST_CASE("A mesh that is inside out is turned", "[scene]") {
  const Folder folder;
  auto ball = icosphere(2, kRadius);
  for (Triangle& t : ball.triangles) std::swap(t[0], t[1]);
  folder.write("ball.obj", test::as_obj(ball));
  const auto body = load(folder);
  CHECK(signed_volume(body.triangles, body.nodes) == Approx(kBallVolume).epsilon(0.1));
}

TEST_CASE("Small faults of a mesh are mended: it has the volume of what was meant", "[scene]") {
  const Folder folder;
  const auto good = icosphere(4, kRadius);
  auto faulty = good;
  std::swap(faulty.triangles[5][0], faulty.triangles[5][1]);
  faulty.triangles.push_back(faulty.triangles[9]);
  faulty.triangles.erase(faulty.triangles.begin() + 20);
  const TriangleMesh mended = closed_mesh(faulty, {}, "ball");
  CHECK(mended.triangles.size() == good.triangles.size());
  CHECK(check_edges(mended.triangles).closed());
  CHECK(signed_volume(mended.triangles, mended.vertices) == Approx(signed_volume(good.triangles, good.vertices)).epsilon(1e-3));
}

TEST_CASE("Shells that overlap or lie in each other are one solid, whichever way they face, and a cavity stays one", "[scene]") {
  constexpr double kSide = 0.1;
  const auto cube_at = [](double side, const Vec3& low, TriangleMesh& to, bool inwards) {
    const auto n = static_cast<std::uint32_t>(to.vertices.size());
    const TriangleMesh cube = test::box_mesh(low, low + Vec3::Constant(side));
    to.vertices.insert(to.vertices.end(), cube.vertices.begin(), cube.vertices.end());
    for (Triangle t : cube.triangles) {
      if (inwards) std::swap(t[1], t[2]);
      to.triangles.push_back({n + t[0], n + t[1], n + t[2]});
    }
  };
  const auto volume_of = [&](double side, const Vec3& low, bool first_inwards, bool second_inwards) {
    TriangleMesh two;
    cube_at(kSide, Vec3::Zero(), two, first_inwards);
    cube_at(side, low, two, second_inwards);
    const auto solid = make_mesh_solid(closed_mesh(two, {}, "two cubes"));
    const Clipped clipped = clip_lattice(grid_around(*solid, 0.005), *solid);
    const double filled = signed_volume(split_shorter(clipped.faces, clipped.nodes.positions), clipped.nodes.positions);
    CHECK(filled == Approx(solid->volume()).epsilon(0.04));
    return solid->volume();
  };
  const double whole = std::pow(kSide, 3), overlap = whole / 4;
  const Vec3 aside(0.05, 0.05, 0);
  for (const bool inwards : {false, true}) {
    CHECK(volume_of(kSide, aside, false, inwards) == Approx(2 * whole - overlap).epsilon(0.02));
    CHECK(volume_of(kSide, aside, true, inwards) == Approx(2 * whole - overlap).epsilon(0.02));
  }
  const Vec3 within(0.02, 0.02, 0.02);
  const double inner = std::pow(0.06, 3);
  CHECK(volume_of(0.06, within, false, false) == Approx(whole).epsilon(0.02));
  CHECK(volume_of(0.06, within, false, true) == Approx(whole - inner).epsilon(0.02));
}

TEST_CASE("Solids that touch in a point, an edge or a face are one surface, and fins without thickness are left out", "[scene]") {
  constexpr double kSide = 0.05;
  const auto cubes = [&](const Vec3& at) {
    TriangleMesh two = test::box_mesh(Vec3::Zero(), Vec3::Constant(kSide));
    const auto n = static_cast<std::uint32_t>(two.vertices.size());
    const TriangleMesh other = test::box_mesh(at, at + Vec3::Constant(kSide));
    two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
    for (const Triangle& t : other.triangles) two.triangles.push_back({n + t[0], n + t[1], n + t[2]});
    return two;
  };
  for (const Vec3& at : {Vec3(kSide, 0, 0), Vec3(kSide, kSide, 0), Vec3(kSide, kSide, kSide)}) {
    const TriangleMesh mesh = closed_mesh(cubes(at), {}, "two cubes");
    CHECK(check_edges(mesh.triangles).bounds());
    CHECK(mesh.triangles.size() == (at.y() == 0 ? 20 : 24));
    const auto solid = make_mesh_solid(mesh);
    CHECK(solid->volume() == Approx(2 * kSide * kSide * kSide).epsilon(0.01));
  }
  const TriangleMesh once = test::box_mesh(Vec3::Zero(), Vec3::Constant(kSide));
  TriangleMesh twice = once, finned = once;
  for (const Triangle& t : once.triangles) twice.triangles.push_back({t[0], t[2], t[1]});
  CHECK(signed_volume(closed_mesh(twice, {}, "twice").triangles, once.vertices) == Approx(kSide * kSide * kSide));
  const auto [a, b, c] = finned.triangles[0];
  finned.vertices.push_back(Vec3::Constant(-0.01));
  finned.triangles.insert(finned.triangles.end(), {{a, b, 8}, {b, a, 8}});
  CHECK(closed_mesh(finned, {}, "finned").triangles.size() == once.triangles.size());
  TriangleMesh beside = once;
  for (const double x : {0.06, 0.061, 0.062}) beside.vertices.push_back(Vec3(x, 0.001 * (x > 0.0605), 0.002 * (x > 0.0615)));
  beside.triangles.push_back({8, 9, 10});
  CHECK(closed_mesh(beside, {}, "beside").triangles.size() == once.triangles.size());
}

TEST_CASE("Every fault of a mesh is answered with scene line, mesh name and what was expected", "[scene]") {
  const Folder folder;
  const auto good = icosphere(2, kRadius);
  const auto expect = [&](const std::string& mesh, const char* words, const std::string& scene = kMeshScene) {
    folder.write("ball.obj", mesh);
    const std::string message = test::error_of(folder, scene);
    INFO(message);
    CHECK(message.find("scene.json:5: mesh ") != std::string::npos);
    CHECK(message.find(words) != std::string::npos);
    CHECK(message.find("; expected ") != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
  };
  auto holed = good;
  holed.triangles.pop_back();
  expect(test::as_obj(holed), "has 3 edges with a triangle on one side only (a hole), one at (");
  const TriangleMesh walled{
      {{0.1, 0, 0}, {0, 0.1, 0}, {-0.1, 0, 0}, {0, -0.1, 0}, {0, 0, 0.1}, {0, 0, -0.1}},
      {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}, {0, 1, 2}, {0, 2, 3}}};
  expect(test::as_obj(walled), "has 4 edges with more triangles one way than the other");
  expect(test::as_obj(good, 1000), "is 100 m across with scale 1; expected 0.005 to 2 m, for example with scale 0.001");
  expect(test::as_obj(good, 1e6), "is 100 km across");
  expect(test::as_obj(good, 0.001), "is 100 um across with scale 1; expected 0.005 to 2 m, for example with scale 1000");
  auto flat = good;
  for (Vec3& v : flat.vertices) v[2] *= 1e-4;
  expect(test::as_obj(flat), "encloses no volume");
  expect("v 0 0 0\nv 1 0 0\n", "");
  expect("", "");
  expect("this is not a mesh\n", "");
  folder.write("cut.stl", as_stl(good).substr(0, 1000));
  expect("", "", replaced(kMeshScene, "ball.obj", "cut.stl"));
  expect("", "cannot be read", replaced(kMeshScene, "ball.obj", "absent.obj"));
  expect("", "is not a surface by its name; expected FILE.obj or FILE.stl", replaced(kMeshScene, "ball.obj", "ball.ply"));
  expect("", "holds tetrahedra by its name; expected a closed surface, FILE.obj or FILE.stl",
         replaced(kMeshScene, "ball.obj", "ball.msh"));
}

TEST_CASE("Fields of a mesh out of range are refused by name", "[scene]") {
  const Folder folder;
  folder.write("ball.obj", test::as_obj(icosphere(2, kRadius)));
  const auto expect = [&](const char* to, const char* words) {
    const std::string message = test::error_of(folder, replaced(kMeshScene, "\"file\": \"ball.obj\"", to));
    INFO(message);
    CHECK(message.find("scene.json:5: body.lattice.clip.mesh.") != std::string::npos);
    CHECK(message.find(words) != std::string::npos);
  };
  expect(R"("scale": 1)", "file is missing");
  expect(R"("file": "")", "file is \"\"");
  expect(R"("file": "ball.obj", "scale": 0)", "scale is 0");
  expect(R"("file": "ball.obj", "scale": "mm")", "scale is a text");
  expect(R"("file": "ball.obj", "offset_m": [0, 0])", "offset_m is [0, 0]");
  expect(R"("file": "ball.obj", "rotate_deg": [0, 0, 0])", "\"rotation_deg\"");
}

}  // namespace
}  // namespace palpate
