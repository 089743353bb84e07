// Data for viewers of a planar body.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "server/core/room_info.hpp"

using namespace palpate;

namespace {

Vec3 doubled_area(const BodyMesh& mesh, const Triangle& t) {
  const auto at = [&](std::uint32_t v) { return mesh.vertices[v].rest; };
  return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
}

}  // namespace

TEST_CASE("a sheet of springs is shown whole: each cell once, all turned the same way, what is held marked") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/sheet13.json");
  REQUIRE(scene.body.triangles.empty());
  const RoomInfo facts = facts_of(scene, Vec3::Zero());
  CHECK(facts.mesh.vertices.size() == 13 * 13);
  CHECK(facts.mesh.triangles.size() == 2 * 12 * 12);
  double area = 0;
  for (const Triangle& t : facts.mesh.triangles) {
    const Vec3 twice = doubled_area(facts.mesh, t);
    CHECK(twice.z() == Approx(0.01 / 144).epsilon(1e-3));  // vertices are quantised
    area += twice.z() / 2;
  }
  CHECK(area == Approx(0.1 * 0.1).epsilon(1e-3));
  const auto held = std::count_if(facts.mesh.vertices.begin(), facts.mesh.vertices.end(), [](const auto& v) { return v.fixed; });
  CHECK(held == 13 + 13 + 11);
}
