#include "server/core/mesh_pieces.hpp"

#include <algorithm>

#include "common/wire/codec.hpp"

namespace palpate {
namespace {

std::uint32_t pieces_of(std::size_t items, std::size_t each) { return static_cast<std::uint32_t>((items + each - 1) / each); }

/// Returns the number of the first item.
template <class Item>
std::uint32_t cut(const std::vector<Item>& all, std::uint32_t number, std::size_t each, std::vector<Item>& items) {
  const std::size_t first = number * each, end = std::min(first + each, all.size());
  items.assign(all.begin() + static_cast<std::ptrdiff_t>(first), all.begin() + static_cast<std::ptrdiff_t>(end));
  return static_cast<std::uint32_t>(first);
}

}  // namespace

std::uint32_t mesh_pieces(const BodyMesh& mesh) {
  return pieces_of(mesh.vertices.size(), kMaxPieceVertices) + pieces_of(mesh.triangles.size(), kMaxPieceTriangles);
}

MeshPiece mesh_piece(const RoomInfo& facts, std::uint32_t piece) {
  MeshPiece cut_out{facts.mesh_hash, piece, mesh_pieces(facts.mesh), 0, {}, {}};
  const auto of_vertices = pieces_of(facts.mesh.vertices.size(), kMaxPieceVertices);
  if (piece < of_vertices)
    cut_out.first = cut(facts.mesh.vertices, piece, kMaxPieceVertices, cut_out.vertices);
  else
    cut_out.first = cut(facts.mesh.triangles, piece - of_vertices, kMaxPieceTriangles, cut_out.triangles);
  return cut_out;
}

std::uint32_t part_pieces(const PartMesh& part) {
  return pieces_of(part.mesh.vertices.size(), kMaxPartItems) + pieces_of(part.mesh.triangles.size(), kMaxPartItems);
}

PartPiece part_piece(const PartMesh& part, std::uint32_t number, std::uint32_t piece) {
  PartPiece cut_out{static_cast<std::uint8_t>(number),
                    part.name,
                    part.colour,
                    part.friction,
                    static_cast<std::uint32_t>(part.mesh.vertices.size()),
                    static_cast<std::uint32_t>(part.mesh.triangles.size()),
                    piece};
  const auto of_vertices = pieces_of(part.mesh.vertices.size(), kMaxPartItems);
  if (piece < of_vertices)
    cut(part.mesh.vertices, piece, kMaxPartItems, cut_out.vertices);
  else
    cut(part.mesh.triangles, piece - of_vertices, kMaxPartItems, cut_out.triangles);
  return cut_out;
}

}  // namespace palpate
