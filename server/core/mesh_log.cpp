#include "server/core/mesh_log.hpp"

#include <algorithm>
#include <utility>

#include "common/wire/codec.hpp"
#include "common/wire/mesh_change.hpp"
#include "server/core/mesh_pieces.hpp"

namespace palpate {
namespace {

/// Cuts a list into pieces of at most `most`.
template <class Item, class F>
void in_pieces(const std::vector<Item>& all, std::size_t most, const F& each) {
  for (std::size_t first = 0; first < all.size(); first += most)
    each(std::vector<Item>(all.begin() + static_cast<std::ptrdiff_t>(first),
                           all.begin() + static_cast<std::ptrdiff_t>(std::min(first + most, all.size()))));
}

}  // namespace

MeshLog::MeshLog(const RoomInfo& facts)
    : hash_(facts.mesh_hash), scene_pieces_(mesh_pieces(facts.mesh)), mesh_(facts.mesh), surface_(facts.mesh, facts.vertex_of) {}

void MeshLog::add(MeshPiece piece) {
  piece.mesh_hash = hash_;
  piece.piece = pieces();
  piece.pieces = piece.piece + 1;
  apply(piece, mesh_);
  changes_.push_back(std::move(piece));
}

bool MeshLog::take(const std::shared_ptr<const BodySurface>& surface) {
  if (surface == taken_) return false;
  taken_ = surface;
  if (!surface) return false;
  surface_.take(*surface);
  if (surface_.mesh().vertices.size() > kMaxMeshVertices) return false;
  MeshPiece change = change_of(mesh_, surface_.mesh());
  in_pieces(change.vertices, kMaxPieceVertices, [&](std::vector<MeshVertex> vertices) {
    add({0, 0, 0, 0, std::move(vertices)});
  });
  // From the end, so that the numbers of those that are still to be removed stay.
  std::reverse(change.removed.begin(), change.removed.end());
  in_pieces(change.removed, kMaxPieceRemoved, [&](std::vector<std::uint32_t> removed) {
    std::reverse(removed.begin(), removed.end());
    add({0, 0, 0, 0, {}, {}, std::move(removed)});
  });
  in_pieces(change.triangles, kMaxPieceTriangles, [&](std::vector<Triangle> triangles) {
    add({0, 0, 0, 0, {}, std::move(triangles)});
  });
  return true;
}

}  // namespace palpate
