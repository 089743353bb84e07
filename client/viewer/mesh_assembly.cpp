#include "client/viewer/mesh_assembly.hpp"

#include <algorithm>

#include "common/wire/mesh_change.hpp"

namespace palpate {
namespace {

template <class Item>
bool lies_within(std::uint32_t first, const std::vector<Item>& items, std::uint32_t all) {
  return first <= all && items.size() <= all - first;
}

/// Returns true when the pieces, in the order of their numbers, have items 0 up to `all` without a gap.
template <class Items>
bool covers(const std::map<std::uint32_t, MeshPiece>& pieces, Items MeshPiece::*items, std::uint32_t all) {
  std::size_t end = 0;
  for (const auto& [number, piece] : pieces) {
    if ((piece.*items).empty()) continue;
    if (piece.first > end) return false;
    end = std::max(end, piece.first + (piece.*items).size());
  }
  return end == all;
}

}  // namespace

void MeshAssembly::expect(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash) {
  vertices_ = vertices;
  triangles_ = triangles;
  hash_ = hash;
  count_ = 0;
  pieces_.clear();
  mesh_ = {};
  scene_pieces_ = applied_ = wanted_ = 0;
  complete_ = triangles == 0;
}

bool MeshAssembly::want(std::uint32_t pieces) {
  const bool more = pieces > wanted_;
  wanted_ = std::max(wanted_, pieces);
  return more;
}

void MeshAssembly::take_change(const MeshPiece& piece) {
  if (piece.mesh_hash != hash_ || piece.piece < applied_ || piece.piece >= wanted_) return;
  pieces_[piece.piece] = piece;
  if (pieces_.size() < wanted_ - applied_) return;
  for (const auto& [number, change] : pieces_) {
    if (apply(change, mesh_)) continue;
    ++rejected_;
    return expect(vertices_, triangles_, hash_);
  }
  applied_ = wanted_;
  pieces_.clear();
}

bool MeshAssembly::fits(const MeshPiece& piece) const {
  if (piece.mesh_hash != hash_ || piece.piece >= piece.pieces) return false;
  if (piece.pieces > std::uint64_t{vertices_} + triangles_) return false;
  if (count_ != 0 && piece.pieces != count_) return false;
  if (!piece.vertices.empty()) return lies_within(piece.first, piece.vertices, vertices_);
  return lies_within(piece.first, piece.triangles, triangles_) &&
         std::all_of(piece.triangles.begin(), piece.triangles.end(),
                     [this](const Triangle& t) { return *std::max_element(t.begin(), t.end()) < vertices_; });
}

void MeshAssembly::take(const MeshPiece& piece) {
  if (complete_) return take_change(piece);
  if (!fits(piece)) {
    ++rejected_;
    return;
  }
  count_ = piece.pieces;
  pieces_[piece.piece] = piece;
  if (pieces_.size() == count_) finish();
}

bool MeshAssembly::covers_all() const {
  return covers(pieces_, &MeshPiece::vertices, vertices_) && covers(pieces_, &MeshPiece::triangles, triangles_);
}

void MeshAssembly::finish() {
  if (covers_all()) {
    mesh_.vertices.resize(vertices_);
    mesh_.triangles.resize(triangles_);
    for (const auto& [number, piece] : pieces_) {
      std::copy(piece.vertices.begin(), piece.vertices.end(),
                mesh_.vertices.begin() + (piece.vertices.empty() ? 0 : piece.first));
      std::copy(piece.triangles.begin(), piece.triangles.end(),
                mesh_.triangles.begin() + (piece.triangles.empty() ? 0 : piece.first));
    }
    complete_ = mesh_hash(mesh_) == hash_;
    scene_pieces_ = applied_ = count_;
  }
  pieces_.clear();
  count_ = 0;
  if (complete_) return;
  mesh_ = {};
  ++rejected_;
}

std::vector<std::uint32_t> MeshAssembly::missing(std::size_t most) const {
  if (!complete_ && count_ == 0) return {0};
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = applied_; i < (complete_ ? wanted_ : count_) && numbers.size() < most; ++i)
    if (!pieces_.contains(i)) numbers.push_back(i);
  return numbers;
}

}  // namespace palpate
