// Rigid parts of a scene on their way to a client: requested piece by piece, and met by its tool.
#include <catch2/catch.hpp>

#include "client/core/parts_assembly.hpp"
#include "common/base/random.hpp"
#include "common/wire/codec.hpp"
#include "server/core/mesh_pieces.hpp"
#include "small_world.hpp"
#include "tests/client/core/ticking_hand.hpp"
#include "tests/support/box_mesh.hpp"

using namespace palpate;
using test::Hand;

namespace {

PartMesh strip(const std::string& name, std::uint32_t vertices) {
  PartMesh part{name, 0x123456, 0.25, {}};
  for (std::uint32_t i = 0; i < vertices; ++i) part.mesh.vertices.push_back({kRestStepM * Vec3(i, i % 7, 3)});
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) part.mesh.triangles.push_back({i, i + 1, i + 2});
  return part;
}

bool same(const PartMesh& a, const PartMesh& b) {
  return a.name == b.name && a.colour == b.colour && a.friction == b.friction && a.mesh.triangles == b.mesh.triangles &&
         std::equal(a.mesh.vertices.begin(), a.mesh.vertices.end(), b.mesh.vertices.begin(), b.mesh.vertices.end(),
                    [](const MeshVertex& p, const MeshVertex& q) { return p.rest == q.rest; });
}

}  // namespace

TEST_CASE("Parts arrive whole over a link that loses pieces and turns their order around") {
  const std::vector<PartMesh> sent{strip("table", 4), strip("bone", 700)};
  PartsAssembly assembly;
  assembly.expect(2, 77);
  CHECK(assembly.parts().empty());
  Random random(4);
  std::vector<PartPiece> on_the_way;
  int rounds = 0;
  for (Micros now{}; assembly.parts().empty(); now = std::max(now + Micros{1'000}, assembly.deadline())) {
    REQUIRE(++rounds < 1000);
    while (const auto piece = assembly.due(now)) {
      const std::uint32_t part = *piece / kPartPieces, k = *piece % kPartPieces;
      REQUIRE((part >= 1 && part <= 2));
      REQUIRE(k < part_pieces(sent[part - 1]));
      if (random.uniform(0, 1) < 0.7) on_the_way.push_back(part_piece(sent[part - 1], part, k));
    }
    std::reverse(on_the_way.begin(), on_the_way.end());
    for (const PartPiece& piece : on_the_way) assembly.take(piece);
    on_the_way.clear();
  }
  REQUIRE(assembly.parts().size() == 2);
  for (std::size_t i = 0; i < 2; ++i) CHECK(same(assembly.parts()[i], sent[i]));
  CHECK(assembly.deadline() == Micros::max());
  assembly.expect(2, 77);
  CHECK(assembly.parts().size() == 2);
  assembly.expect(2, 78);
  CHECK(assembly.parts().empty());
}

TEST_CASE("A part whose triangles name vertices that it lacks is left out, and pieces of no part change nothing") {
  PartMesh wrong = strip("wrong", 40);
  wrong.mesh.triangles[3][1] = 40;
  const PartMesh right = strip("right", 40);
  PartsAssembly assembly;
  assembly.expect(2, 5);
  PartPiece piece = part_piece(right, 3, 0);
  assembly.take(piece);  // of a part that is not there
  piece = part_piece(right, 1, 0);
  assembly.take(piece);
  piece.all_vertices = 41;
  assembly.take(piece);
  piece = part_piece(right, 1, 0);
  piece.piece = 17;
  assembly.take(piece);
  for (std::uint32_t k = 0; k < 2; ++k) {
    assembly.take(part_piece(right, 1, k));
    assembly.take(part_piece(wrong, 2, k));
  }
  REQUIRE(assembly.parts().size() == 1);
  CHECK(same(assembly.parts()[0], right));
}

TEST_CASE("A tool is pushed by a part without any patch, with half the device's stiffness, and let go over 50 ticks") {
  const TriangleMesh mesh = test::box_mesh(Vec3(-0.1, -0.1, -0.05), Vec3(0.1, 0.1, 0));
  const double friction = 0;
  const PartWalls walls(std::span(&mesh, 1), std::span(&friction, 1), {}, 1000);
  Hand hand;
  GuardLimits limits = hand.haptic.limits();
  limits.stiffness_max_n_m = 600;
  hand.haptic.limit(limits);
  hand.haptic.meet(&walls, Micros::max());
  CHECK(hand.ticks(100, Vec3(0, 0, 0.01)).force.norm() == 0);
  for (int k = 0; k < 20; ++k) hand.tick(Vec3(0, 0, 0.01 - 0.0006 * k));
  const TickOutput pressed = hand.ticks(50, Vec3(0, 0, -0.002));
  CHECK_FALSE(pressed.has_patch);
  CHECK(pressed.force.z() == Approx(300 * 0.002));
  hand.haptic.meet(&walls, hand.now());
  double before = pressed.force.z();
  for (int k = 0; k < 50; ++k) {
    const double now = hand.tick(Vec3(0, 0, -0.002)).force.z();
    CHECK(now <= before + 1e-12);
    CHECK(before - now < 0.05 * pressed.force.z());
    before = now;
  }
  CHECK(before == Approx(0).margin(1e-12));
}

TEST_CASE("A station has the parts of its scene a second after it joined over a bad link, and keeps them through a pause") {
  SmallWorld world;
  world.parts = {strip("table", 4), strip("bone", 300)};
  world.tool = {{.centre = Vec3(0, 0, 0.0625), .radius_m = 0.00390625}};
  world.start_server(2);
  world.link = {Micros{60'000}, Micros{20'000}, 0.1, 0.02};
  auto& hand = world.add(1, "hand");
  world.run(Micros{1'500'000});
  REQUIRE(hand.parts().size() == 2);
  CHECK(same(hand.parts()[1], world.parts[1]));
  CHECK(hand.welcome().tool == world.tool);
  CHECK(hand.welcome().coupling_n_m == 1000);
  world.start_server(3);
  world.run(Micros{5'000'000});
  CHECK(hand.counts().joins > 1);
  CHECK(hand.parts().size() == 2);
}
