// Rigid parts of a scene: what is read, and what is refused.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "scene_files.hpp"
#include "server/scene/parts.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

using test::as_obj;
using test::error_of;
using test::Folder;
using test::icosphere;
using test::replaced;

// A block of 60 mm above z = 0, and a ball of 30 mm beside it.
const std::string kBlockAndBall = R"({"body": {"lattice": {
  "nodes": [4, 4, 4], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"], "solid": {"young_pa": 5000}}},
  "parts": [{"name": "ball", "mesh": {"file": "ball.obj", "offset_m": [0.1, 0.03, 0.03]}}]})";

struct BallFolder : Folder {
  BallFolder() { write("ball.obj", as_obj(icosphere(3, 0.03))); }
};

TEST_CASE("A part has the signed distance of its surface, a colour, and friction", "[scene][parts]") {
  const BallFolder folder;
  const auto text = replaced(kBlockAndBall, "\"name\": \"ball\"", R"("name": "ball", "colour": "#12ab9F", "mu": 0.7)");
  const LumpedBody body = load_scene(folder.write("scene.json", text)).body;
  REQUIRE(body.parts.size() == 1);
  const RigidPart& ball = *body.parts[0];
  CHECK(ball.name == "ball");
  CHECK(ball.colour == 0x12ab9f);
  CHECK(ball.friction == 0.7);
  CHECK(signed_volume(ball.triangles, ball.vertices) > 0);
  const Vec3 centre(0.1, 0.03, 0.03);
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, 2, -2)}) {
    const auto at = ball.distance.at(centre + 0.028 * direction.normalized());
    REQUIRE(at);
    CHECK(at->distance_m == Approx(-0.002).margin(3e-4));  // a ball of flat triangles
    CHECK(at->gradient.normalized().dot(direction.normalized()) > 0.99);
  }
}

TEST_CASE("A part that overlaps the body is refused with the depth and the place", "[scene][parts]") {
  const BallFolder folder;
  const auto error = [&](const std::string& offset) {
    return error_of(folder, replaced(kBlockAndBall, "0.1, 0.03, 0.03", offset));
  };
  CHECK(error("0.09, 0.02, 0.02").empty());  // it touches a node
  const std::string deep = error("0.085, 0.02, 0.02");
  const std::string before = "parts[0] (\"ball\") and the body overlap by ";
  REQUIRE(deep.find(before) != std::string::npos);
  CHECK(std::stod(deep.substr(deep.find(before) + before.size())) == Approx(5).margin(0.1));  // a ball of flat triangles
  CHECK(deep.find(", 0.02, 0.02) m") != std::string::npos);
  // It is between the nodes of the block's surface, or inside the block.
  CHECK(error("0.0895, 0.03, 0.03").find("overlap by 0.5 mm") != std::string::npos);
  CHECK(error("0.03, 0.03, 0.03").find("overlap by") != std::string::npos);
}

TEST_CASE("A part that is open, without a name, or beside a sheet or cuts is refused", "[scene][parts]") {
  const BallFolder folder;
  TriangleMesh open = icosphere(2, 0.03);
  open.triangles.resize(open.triangles.size() / 2);
  folder.write("open.obj", as_obj(open));
  const auto error = [&](const std::string& from, const std::string& to) {
    return error_of(folder, replaced(kBlockAndBall, from, to));
  };
  CHECK(error("ball.obj", "open.obj").find("a triangle on one side only (a hole)") != std::string::npos);
  CHECK(error("ball.obj", "none.obj").find("none.obj") != std::string::npos);
  CHECK(error("\"name\": \"ball\", ", "").find("parts[0].name") != std::string::npos);
  CHECK(error("\"name\": \"ball\"", "\"name\": \"ball\", \"colour\": \"red\"").find("#rrggbb") != std::string::npos);
  CHECK(error("\"name\": \"ball\"", "\"name\": \"ball\", \"mu\": -1").find("parts[0].mu is -1") != std::string::npos);
  CHECK(error("[4, 4, 4], \"size_m\": [0.06, 0.06, 0.06], \"fixed_faces\": [\"z-\"], \"solid\": {\"young_pa\": 5000}",
              "[4, 4], \"size_m\": [0.06, 0.06], \"fixed_faces\": [\"x-\"], \"stiffness_n_m\": 10, \"damping_n_s_m\": 0.1")
            .find("parts[0] is given with a sheet") != std::string::npos);
  CHECK(
      error(
          "\"parts\": [{\"name\": \"ball\"",
          "\"parts\": [{\"name\": \"ball\", \"mesh\": {\"file\": \"ball.obj\", \"offset_m\": [0.3, 0, 0]}}, {\"name\": \"ball\"")
          .find("a name of its own") != std::string::npos);
}

TEST_CASE("A scene with parts is printed as it is read", "[scene][parts]") {
  const BallFolder folder;
  const std::string printed = print_scene(folder.write("scene.json", kBlockAndBall));
  CHECK(print_scene(folder.write("scene.json", printed)) == printed);
  CHECK(printed.find("#c8c8d0") != std::string::npos);
}

}  // namespace
}  // namespace palpate
