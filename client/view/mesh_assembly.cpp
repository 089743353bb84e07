#include "client/view/mesh_assembly.hpp"

#include <algorithm>

namespace palpate {
namespace {

template <class Item>
bool lies_within(std::uint32_t first, const std::vector<Item>& items, const std::vector<Item>& all) {
  return first <= all.size() && items.size() <= all.size() - first;
}

template <class Item>
void put(std::uint32_t first, const std::vector<Item>& items, std::vector<Item>& all, std::vector<bool>& has) {
  std::copy(items.begin(), items.end(), all.begin() + first);
  std::fill_n(has.begin() + first, items.size(), true);
}

bool all_of(const std::vector<bool>& flags) { return std::find(flags.begin(), flags.end(), false) == flags.end(); }

}  // namespace

void MeshAssembly::expect(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash) {
  hash_ = hash;
  mesh_.vertices.assign(vertices, MeshVertex{});
  mesh_.triangles.assign(triangles, Triangle{});
  has_vertex_.assign(vertices, false);
  has_triangle_.assign(triangles, false);
  has_piece_.clear();
  complete_ = triangles == 0;
}

bool MeshAssembly::fits(const MeshPiece& piece) const {
  if (piece.mesh_hash != hash_ || piece.piece >= piece.pieces) return false;
  if (piece.pieces > mesh_.vertices.size() + mesh_.triangles.size()) return false;
  if (!has_piece_.empty() && piece.pieces != has_piece_.size()) return false;
  if (!piece.vertices.empty()) return lies_within(piece.first, piece.vertices, mesh_.vertices);
  return lies_within(piece.first, piece.triangles, mesh_.triangles) &&
         std::all_of(piece.triangles.begin(), piece.triangles.end(),
                     [this](const Triangle& t) { return *std::max_element(t.begin(), t.end()) < mesh_.vertices.size(); });
}

void MeshAssembly::take(const MeshPiece& piece) {
  if (complete_) return;
  if (!fits(piece)) {
    ++rejected_;
    return;
  }
  if (has_piece_.empty()) has_piece_.assign(piece.pieces, false);
  has_piece_[piece.piece] = true;
  if (!piece.vertices.empty())
    put(piece.first, piece.vertices, mesh_.vertices, has_vertex_);
  else
    put(piece.first, piece.triangles, mesh_.triangles, has_triangle_);
  if (all_of(has_piece_)) finish();
}

void MeshAssembly::finish() {
  complete_ = all_of(has_vertex_) && all_of(has_triangle_) && mesh_hash(mesh_) == hash_;
  if (complete_) return;
  ++rejected_;
  expect(static_cast<std::uint32_t>(mesh_.vertices.size()), static_cast<std::uint32_t>(mesh_.triangles.size()), hash_);
}

std::vector<std::uint32_t> MeshAssembly::missing(std::size_t most) const {
  if (complete_) return {};
  if (has_piece_.empty()) return {0};
  std::vector<std::uint32_t> pieces;
  for (std::uint32_t i = 0; i < has_piece_.size() && pieces.size() < most; ++i) {
    if (!has_piece_[i]) pieces.push_back(i);
  }
  return pieces;
}

}  // namespace palpate
