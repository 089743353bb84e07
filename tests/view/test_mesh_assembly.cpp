#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "client/view/mesh_assembly.hpp"
#include "common/wire/mesh_hash.hpp"
#include "tests/view/demo_body.hpp"

using namespace palpate;

namespace {

std::vector<MeshPiece> cut(const std::vector<Triangle>& triangles, std::uint64_t hash, std::uint32_t size) {
  const auto count = static_cast<std::uint32_t>((triangles.size() + size - 1) / size);
  std::vector<MeshPiece> pieces;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto first = triangles.begin() + i * size;
    const auto last = std::min<std::ptrdiff_t>(size, triangles.end() - first);
    pieces.push_back({hash, i, count, i * size, {first, first + last}});
  }
  return pieces;
}

}  // namespace

TEST_CASE("A mesh comes together from pieces in any order, repeated and asked for until none is missing", "[view]") {
  const demo::Body body = demo::unit_sphere(3);
  const auto vertices = static_cast<std::uint32_t>(body.rest.size());
  const std::uint64_t hash = mesh_hash(vertices, body.triangles);
  auto pieces = cut(body.triangles, hash, 100);
  MeshAssembly mesh;
  mesh.expect(vertices, static_cast<std::uint32_t>(body.triangles.size()), hash);
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
  REQUIRE(mesh.triangles() == body.triangles);
}

TEST_CASE("A mesh with another content than its hash says is dropped and asked for again", "[view]") {
  const demo::Body body = demo::unit_sphere(2);
  const auto vertices = static_cast<std::uint32_t>(body.rest.size());
  const std::uint64_t hash = mesh_hash(vertices, body.triangles);
  const auto pieces = cut(body.triangles, hash, 50);
  auto wrong = pieces;
  std::swap(wrong[1].triangles[3][0], wrong[1].triangles[3][1]);
  MeshAssembly mesh;
  mesh.expect(vertices, static_cast<std::uint32_t>(body.triangles.size()), hash);
  for (const auto& piece : wrong) mesh.take(piece);
  REQUIRE_FALSE(mesh.complete());
  REQUIRE(mesh.rejected() == 1);
  for (const auto& piece : pieces) mesh.take(piece);
  REQUIRE(mesh.complete());
}

TEST_CASE("Pieces that point outside the announced mesh are refused", "[view]") {
  MeshAssembly mesh;
  mesh.expect(4, 4, 99);
  const Triangle inside{0, 1, 2}, outside{0, 1, 4};
  mesh.take({98, 0, 1, 0, {inside}});               // of another mesh
  mesh.take({99, 0, 1, 0, {outside}});              // a vertex that is not there
  mesh.take({99, 0, 1, 3, {inside, inside}});       // beyond the last triangle
  mesh.take({99, 0, 1, 4'000'000'000u, {inside}});  // far beyond
  mesh.take({99, 1, 1, 0, {inside}});               // piece 1 of 1
  mesh.take({99, 0, 2'000'000'000u, 0, {inside}});  // more pieces than triangles
  REQUIRE(mesh.rejected() == 6);
  REQUIRE_FALSE(mesh.complete());
}
