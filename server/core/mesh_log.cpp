#include "server/core/mesh_log.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "common/wire/codec.hpp"
#include "common/wire/mesh_change.hpp"
#include "server/core/mesh_pieces.hpp"

namespace palpate {
namespace {

constexpr std::uint32_t kNoPlace = ~0U;

/// Cuts a list into pieces of at most `most`.
template <class Item, class F>
void in_pieces(const std::vector<Item>& all, std::size_t most, const F& each) {
  for (std::size_t first = 0; first < all.size(); first += most)
    each(std::vector<Item>(all.begin() + static_cast<std::ptrdiff_t>(first),
                           all.begin() + static_cast<std::ptrdiff_t>(std::min(first + most, all.size()))));
}

}  // namespace

MeshLog::MeshLog(const RoomInfo& facts)
    : hash_(facts.mesh_hash), scene_pieces_(mesh_pieces(facts.mesh)), mesh_(facts.mesh), vertex_of_(facts.vertex_of) {
  for (std::uint32_t k = 0; k < vertex_of_.size(); ++k) {
    if (vertex_of_[k] >= place_of_.size()) place_of_.resize(vertex_of_[k] + 1, kNoPlace);
    place_of_[vertex_of_[k]] = k;
  }
}

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
  place_of_.resize(surface->vertices.size(), kNoPlace);
  std::vector<MeshVertex> fresh;
  const auto place = [&](std::uint32_t number) {
    if (place_of_[number] != kNoPlace) return place_of_[number];
    const BodySurface::Vertex& vertex = surface->vertices[number];
    fresh.push_back({vertex.rest.unaryExpr(&to_rest_step), vertex.fixed, vertex.wall});
    vertex_of_.push_back(number);
    return place_of_[number] = static_cast<std::uint32_t>(vertex_of_.size() - 1);
  };
  std::multiset<Triangle> missing;
  for (const Triangle& t : surface->triangles) missing.insert({place(t[0]), place(t[1]), place(t[2])});
  std::vector<std::uint32_t> gone;
  for (std::uint32_t k = 0; k < mesh_.triangles.size(); ++k) {
    const auto same = missing.find(mesh_.triangles[k]);
    if (same == missing.end())
      gone.push_back(k);
    else
      missing.erase(same);
  }
  if (vertex_of_.size() > kMaxMeshVertices) return false;
  in_pieces(fresh, kMaxPieceVertices, [&](std::vector<MeshVertex> vertices) { add({0, 0, 0, 0, std::move(vertices)}); });
  // From the end, so that the numbers of those that are still to be removed stay.
  std::reverse(gone.begin(), gone.end());
  in_pieces(gone, kMaxPieceRemoved, [&](std::vector<std::uint32_t> removed) {
    std::reverse(removed.begin(), removed.end());
    add({0, 0, 0, 0, {}, {}, std::move(removed)});
  });
  in_pieces(std::vector<Triangle>(missing.begin(), missing.end()), kMaxPieceTriangles, [&](std::vector<Triangle> triangles) {
    add({0, 0, 0, 0, {}, std::move(triangles)});
  });
  return true;
}

}  // namespace palpate
