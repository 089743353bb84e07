#include "client/core/parts_assembly.hpp"

#include <algorithm>

#include "common/wire/codec.hpp"

namespace palpate {
namespace {

std::uint32_t pieces_of(std::uint32_t items) { return static_cast<std::uint32_t>((items + kMaxPartItems - 1) / kMaxPartItems); }

}  // namespace

std::uint32_t PartsAssembly::Gathered::count() const { return pieces.empty() ? 1 : pieces_of(vertices) + pieces_of(triangles); }

void PartsAssembly::expect(std::uint8_t parts, std::uint64_t scene_hash) {
  asking_.clear();
  asked_ = 0;
  next_ = Micros{};
  if (scene_hash != 0 && scene_hash == scene_hash_ && gathered_.size() == parts) return;
  scene_hash_ = scene_hash;
  gathered_.assign(parts, {});
  parts_.clear();
  ++version_;
  complete_ = parts == 0;
}

void PartsAssembly::take(const PartPiece& piece) {
  if (complete_ || piece.part > gathered_.size()) return;
  Gathered& part = gathered_[piece.part - 1];
  if (part.pieces.empty()) {
    part.vertices = piece.all_vertices;
    part.triangles = piece.all_triangles;
  }
  if (piece.all_vertices != part.vertices || piece.all_triangles != part.triangles) return;
  if (piece.piece >= pieces_of(part.vertices) + pieces_of(part.triangles)) return;
  part.pieces.try_emplace(piece.piece, piece);
  if (asked_ > 0 && --asked_ == 0) next_ = Micros{};
  if (std::ranges::all_of(gathered_, [](const Gathered& g) { return g.pieces.size() == g.count() && !g.pieces.empty(); }))
    finish();
}

std::optional<std::uint32_t> PartsAssembly::due(Micros now) {
  if (complete_) return std::nullopt;
  if (asking_.empty()) {
    if (now < next_) return std::nullopt;
    for (std::uint32_t p = 0; p < gathered_.size(); ++p)
      for (std::uint32_t k = 0; k < gathered_[p].count() && asking_.size() < kWindow; ++k)
        if (!gathered_[p].pieces.contains(k)) asking_.push_back((p + 1) * kPartPieces + k);
    asked_ = asking_.size();
    next_ = now + kRetry;
  }
  const std::uint32_t piece = asking_.front();
  asking_.pop_front();
  return piece;
}

void PartsAssembly::finish() {
  complete_ = true;
  ++version_;
  asking_.clear();
  for (Gathered& gathered : gathered_) {
    const PartPiece& first = gathered.pieces.begin()->second;
    PartMesh part{first.name, first.colour, first.friction, {}};
    for (const auto& [number, piece] : gathered.pieces) {
      part.mesh.vertices.insert(part.mesh.vertices.end(), piece.vertices.begin(), piece.vertices.end());
      part.mesh.triangles.insert(part.mesh.triangles.end(), piece.triangles.begin(), piece.triangles.end());
    }
    gathered.pieces.clear();
    const bool whole = !part.mesh.triangles.empty() && part.mesh.vertices.size() == gathered.vertices &&
                       part.mesh.triangles.size() == gathered.triangles &&
                       std::ranges::all_of(part.mesh.triangles, [&](const Triangle& t) {
                         return std::ranges::all_of(t, [&](std::uint32_t i) { return i < gathered.vertices; });
                       });
    if (whole) parts_.push_back(std::move(part));
  }
}

}  // namespace palpate
