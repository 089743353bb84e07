#include "client/view/mesh_assembly.hpp"

#include <algorithm>

#include "common/wire/mesh_hash.hpp"

namespace palpate {

void MeshAssembly::expect(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash) {
  vertices_ = vertices;
  hash_ = hash;
  triangles_.assign(triangles, Triangle{});
  has_triangle_.assign(triangles, false);
  has_piece_.clear();
  complete_ = triangles == 0;
}

bool MeshAssembly::fits(const MeshPiece& piece) const {
  if (piece.mesh_hash != hash_ || piece.piece >= piece.pieces || piece.pieces > triangles_.size()) return false;
  if (!has_piece_.empty() && piece.pieces != has_piece_.size()) return false;
  if (piece.first > triangles_.size() || piece.triangles.size() > triangles_.size() - piece.first) return false;
  return std::all_of(piece.triangles.begin(), piece.triangles.end(),
                     [this](const Triangle& t) { return *std::max_element(t.begin(), t.end()) < vertices_; });
}

void MeshAssembly::take(const MeshPiece& piece) {
  if (complete_) return;
  if (!fits(piece)) {
    ++rejected_;
    return;
  }
  if (has_piece_.empty()) has_piece_.assign(piece.pieces, false);
  has_piece_[piece.piece] = true;
  for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
    triangles_[piece.first + i] = piece.triangles[i];
    has_triangle_[piece.first + i] = true;
  }
  if (std::find(has_piece_.begin(), has_piece_.end(), false) == has_piece_.end()) finish();
}

void MeshAssembly::finish() {
  const bool all = std::find(has_triangle_.begin(), has_triangle_.end(), false) == has_triangle_.end();
  complete_ = all && mesh_hash(vertices_, triangles_) == hash_;
  if (complete_) return;
  ++rejected_;
  has_piece_.clear();
  has_triangle_.assign(triangles_.size(), false);
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
