#include <malloc.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "client/viewer/mesh_assembly.hpp"
#include "common/wire/codec.hpp"
#include "server/core/mesh_pieces.hpp"
#include "tests/client/view/demo_body.hpp"

using namespace palpate;

namespace {

std::vector<MeshPiece> cut(const RoomInfo& facts) {
  std::vector<MeshPiece> pieces;
  for (std::uint32_t k = 0; k < mesh_pieces(facts.mesh); ++k) pieces.push_back(mesh_piece(facts, k));
  return pieces;
}

MeshAssembly expecting(const RoomInfo& facts) {
  MeshAssembly mesh;
  mesh.expect(static_cast<std::uint32_t>(facts.mesh.vertices.size()), static_cast<std::uint32_t>(facts.mesh.triangles.size()),
              facts.mesh_hash);
  return mesh;
}

}  // namespace

TEST_CASE("A mesh comes together from pieces in any order, repeated and asked for until none is missing", "[view]") {
  const RoomInfo facts = demo::facts_of(demo::pressed_organ(0, 0, 3));
  auto pieces = cut(facts);
  REQUIRE(pieces.size() > 6);
  MeshAssembly mesh = expecting(facts);
  REQUIRE(mesh.missing(16) == std::vector<std::uint32_t>{0});

  std::mt19937 random(7);
  std::shuffle(pieces.begin(), pieces.end(), random);
  for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
    mesh.take(pieces[i]);
    mesh.take(pieces[i]);
  }
  REQUIRE_FALSE(mesh.complete());
  REQUIRE(mesh.missing(16) == std::vector<std::uint32_t>{pieces.back().piece});
  mesh.take(pieces.back());
  REQUIRE(mesh.complete());
  REQUIRE(mesh.missing(16).empty());
  REQUIRE(mesh.mesh().triangles == facts.mesh.triangles);
  for (std::size_t i = 0; i < facts.mesh.vertices.size(); ++i) {
    REQUIRE(mesh.mesh().vertices[i].rest == facts.mesh.vertices[i].rest);
    REQUIRE(mesh.mesh().vertices[i].fixed == facts.mesh.vertices[i].fixed);
  }
}

TEST_CASE("A mesh with another content than its hash says is dropped and asked for again", "[view]") {
  const RoomInfo facts = demo::facts_of(demo::pressed_organ(0, 0, 3));
  const auto pieces = cut(facts);
  const auto twisted = [&](std::vector<MeshPiece> wrong) {
    std::swap(wrong.back().triangles[3][0], wrong.back().triangles[3][1]);
    return wrong;
  };
  const auto moved = [&](std::vector<MeshPiece> wrong) {
    wrong[0].vertices[5].rest.y() += kRestStepM;
    return wrong;
  };
  const auto freed = [&](std::vector<MeshPiece> wrong) {
    wrong[0].vertices[5].fixed = !wrong[0].vertices[5].fixed;
    return wrong;
  };
  for (const auto& wrong : {twisted(pieces), moved(pieces), freed(pieces)}) {
    MeshAssembly mesh = expecting(facts);
    for (const auto& piece : wrong) mesh.take(piece);
    REQUIRE_FALSE(mesh.complete());
    REQUIRE(mesh.rejected() == 1);
    for (const auto& piece : pieces) mesh.take(piece);
    REQUIRE(mesh.complete());
  }
}

TEST_CASE("Pieces that point outside the announced mesh are refused", "[view]") {
  MeshAssembly mesh;
  mesh.expect(4, 4, 99);
  const Triangle inside{0, 1, 2}, outside{0, 1, 4};
  mesh.take({98, 0, 1, 0, {}, {inside}});               // another mesh
  mesh.take({99, 0, 1, 0, {}, {outside}});              // a vertex that does not exist
  mesh.take({99, 0, 1, 3, {}, {inside, inside}});       // beyond the last triangle
  mesh.take({99, 0, 1, 3, {{}, {}}, {}});               // beyond the last vertex
  mesh.take({99, 0, 1, 4'000'000'000u, {}, {inside}});  // far beyond
  mesh.take({99, 1, 1, 0, {}, {inside}});               // piece 1 of 1
  mesh.take({99, 0, 2'000'000'000u, 0, {}, {inside}});  // more pieces than items
  REQUIRE(mesh.rejected() == 7);
  REQUIRE_FALSE(mesh.complete());
}

TEST_CASE("A mesh that is only announced, or told of in a piece, costs no memory", "[view]") {
  const auto used = [] { return ::mallinfo2().uordblks + ::mallinfo2().hblkhd; };
  MeshAssembly mesh;
  const std::size_t before = used();
  mesh.expect(kMaxMeshVertices, ~std::uint32_t{0}, 7);
  MeshPiece piece{7, 1u << 25, ~std::uint32_t{0}, kMaxMeshVertices - 1, {MeshVertex{}}, {}};
  mesh.take(piece);
  CHECK(mesh.rejected() == 0);
  CHECK(mesh.missing(16).size() == 16);
  CHECK(used() - before < 10'000);
}

TEST_CASE("A mesh whose pieces leave something out, or of which one is missing for another's number, is dropped", "[view]") {
  const RoomInfo facts = demo::facts_of(demo::pressed_organ(0, 0, 3));
  auto pieces = cut(facts);
  MeshAssembly mesh = expecting(facts);
  pieces[1].vertices = pieces[0].vertices;
  pieces[1].first = 0;
  for (const MeshPiece& piece : pieces) mesh.take(piece);
  CHECK_FALSE(mesh.complete());
  CHECK(mesh.rejected() == 1);
  for (const MeshPiece& piece : cut(facts)) mesh.take(piece);
  CHECK(mesh.complete());
}
