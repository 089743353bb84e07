#include "server/core/mesh_pieces.hpp"

#include <algorithm>

#include "common/wire/codec.hpp"

namespace palpate {
namespace {

std::uint32_t pieces_of(std::size_t items, std::size_t each) { return static_cast<std::uint32_t>((items + each - 1) / each); }

template <class Item>
void cut(const std::vector<Item>& all, std::uint32_t number, std::size_t each, MeshPiece& piece, std::vector<Item>& items) {
  const std::size_t first = number * each, end = std::min(first + each, all.size());
  piece.first = static_cast<std::uint32_t>(first);
  items.assign(all.begin() + static_cast<std::ptrdiff_t>(first), all.begin() + static_cast<std::ptrdiff_t>(end));
}

}  // namespace

std::uint32_t mesh_pieces(const BodyMesh& mesh) {
  return pieces_of(mesh.vertices.size(), kMaxPieceVertices) + pieces_of(mesh.triangles.size(), kMaxPieceTriangles);
}

MeshPiece mesh_piece(const RoomInfo& facts, std::uint32_t piece) {
  MeshPiece cut_out{facts.mesh_hash, piece, mesh_pieces(facts.mesh), 0, {}, {}};
  const auto of_vertices = pieces_of(facts.mesh.vertices.size(), kMaxPieceVertices);
  if (piece < of_vertices)
    cut(facts.mesh.vertices, piece, kMaxPieceVertices, cut_out, cut_out.vertices);
  else
    cut(facts.mesh.triangles, piece - of_vertices, kMaxPieceTriangles, cut_out, cut_out.triangles);
  return cut_out;
}

}  // namespace palpate
