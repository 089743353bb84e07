// What viewers are told of a room's body.
#include "server/core/room_info.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

namespace palpate {
namespace {

// A block of 60 mm, and one of half its size on it.
constexpr const char* kTwo = R"({"bodies": [
  {"name": "below", "lattice": {"nodes": [4, 4, 4], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"], "solid": {"young_pa": 5000}}},
  {"name": "above", "colour": "#12ab9F", "lattice": {
    "nodes": [3, 3, 3], "size_m": [0.03, 0.03, 0.03], "origin_m": [0.01, 0.01, 0.06], "solid": {"young_pa": 5000}},
    "ligaments": [{"from_m": [0.025, 0.025, 0.095], "radius_m": 0.04, "to_m": [0.025, 0.025, 0.12], "stiffness_n_m": 100}]}]})";

TEST_CASE("Viewers are told which body each vertex belongs to, and of one body nothing", "[core]") {
  const Scene scene = read_scene(kTwo, "two");
  const RoomInfo facts = facts_of(scene, Vec3::Zero());
  REQUIRE(facts.bodies.size() == 2);
  CHECK(facts.bodies[0].name == "below");
  CHECK(facts.bodies[1].colour == 0x12ab9f);
  REQUIRE(facts.mesh.vertices.size() == 56 + 26);
  for (const MeshVertex& vertex : facts.mesh.vertices)
    if (std::abs(vertex.rest.z() - 0.06) > 1e-4) CHECK(int{vertex.body} == (vertex.rest.z() > 0.06 ? 1 : 0));
  CHECK(std::ranges::count(facts.mesh.vertices, 1, &MeshVertex::body) == 26);
  Scene alone = scene;
  alone.body.members.clear();
  CHECK(facts_of(alone, Vec3::Zero()).bodies.empty());
}

}  // namespace
}  // namespace palpate
