#include "client/viewer/shape_assembly.hpp"

#include <algorithm>

namespace palpate {
namespace {

bool is_newer(std::uint32_t frame, std::uint32_t than) { return static_cast<std::int32_t>(frame - than) > 0; }

}  // namespace

void ShapeAssembly::rest(const std::vector<MeshVertex>& vertices) {
  rest_.clear();
  for (const MeshVertex& vertex : vertices) rest_.push_back(vertex.rest.cast<float>());
  positions_ = rest_;
  for (auto& scalars : fields_) scalars.assign(rest_.size(), 0.0F);
  for (auto& frames : block_frames_) frames.assign((rest_.size() + kBlockVertices - 1) / kBlockVertices, 0);
  frame_ = 0;
  open_ = false;
}

void ShapeAssembly::extend(const std::vector<MeshVertex>& vertices, const std::vector<std::uint32_t>& like) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    rest_.push_back(vertices[i].rest.cast<float>());
    positions_.push_back(rest_.back() + positions_[like[i]] - rest_[like[i]]);
    for (auto& scalars : fields_) scalars.push_back(scalars[like[i]]);
  }
  for (auto& frames : block_frames_) frames.resize((rest_.size() + kBlockVertices - 1) / kBlockVertices, 0);
}

bool ShapeAssembly::fits(const ShapePiece& piece) const {
  BlockReader reader(piece.blocks, components_of(piece.channel));
  for (ShapeBlock block; reader.next(block);)
    if (std::size_t{block.index} * kBlockVertices + block.vertices > rest_.size()) return false;
  return true;
}

void ShapeAssembly::emit(std::vector<Shape>& finished) {
  open_ = false;
  ++(came_ + 1 == expected_ ? counts_.complete : counts_.healed);
  finished.push_back({body_time_, positions_,
                      shown_ == ShapeChannel::position ? std::vector<float>{} : fields_[static_cast<std::size_t>(shown_)],
                      shown_});
}

/// Opens the frame when it is a newer one. Returns false when it is over.
bool ShapeAssembly::reach(std::uint32_t frame, Micros body_time, std::vector<Shape>& finished) {
  if (frame_ != 0 && !is_newer(frame, frame_)) return open_ && frame == frame_;
  if (open_) emit(finished);
  frame_ = frame;
  body_time_ = body_time;
  came_ = expected_ = 0;
  open_ = true;
  return true;
}

void ShapeAssembly::take(const ShapePiece& piece, std::vector<Shape>& finished) {
  if (reach(piece.frame, piece.body_time, finished))
    ++came_;
  else
    ++counts_.late_pieces;
  counts_.bytes += piece.blocks.size();
  BlockReader reader(piece.blocks, components_of(piece.channel));
  for (ShapeBlock block; reader.next(block);) apply(block, piece);
  if (open_ && came_ + 1 == expected_) emit(finished);
}

void ShapeAssembly::take(const Tools& tools, std::vector<Shape>& finished) {
  if (!reach(tools.frame, tools.body_time, finished)) return;
  expected_ = tools.pieces + 1u;
  if (came_ + 1 == expected_) emit(finished);
}

void ShapeAssembly::apply(const ShapeBlock& block, const ShapePiece& piece) {
  const auto channel = static_cast<std::size_t>(piece.channel);
  const std::size_t first = std::size_t{block.index} * kBlockVertices;
  if (block.index >= block_frames_[channel].size() || block.vertices > rest_.size() - first) {
    ++counts_.misfits;
    return;
  }
  auto& heard = block_frames_[channel][block.index];
  if (heard != 0 && is_newer(heard, piece.frame)) return;
  heard = piece.frame;
  const auto unit = static_cast<float>(piece.unit);
  for (std::size_t i = 0; i < block.vertices; ++i) {
    const auto number = [&](std::size_t k) { return unit * static_cast<float>(block.numbers[k]); };
    if (piece.channel == ShapeChannel::position)
      positions_[first + i] = rest_[first + i] + Eigen::Vector3f(number(3 * i), number(3 * i + 1), number(3 * i + 2));
    else
      fields_[channel][first + i] = number(i);
  }
}

}  // namespace palpate
