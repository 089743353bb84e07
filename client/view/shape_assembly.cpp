#include "client/view/shape_assembly.hpp"

namespace palpate {

void ShapeAssembly::expect(std::uint32_t vertices) {
  positions_.assign(vertices, Eigen::Vector3f::Zero());
  shape_of_.assign(vertices, 0);
  number_ = 0;
  unknown_ = missing_ = vertices;
  body_time_ = {};
  open_ = false;
}

void ShapeAssembly::begin(Micros body_time) {
  ++number_;
  body_time_ = body_time;
  missing_ = positions_.size();
  open_ = true;
}

void ShapeAssembly::emit(std::vector<Shape>& finished) {
  open_ = false;
  if (unknown_ > 0) {
    ++counts_.dropped;
    return;
  }
  ++(missing_ == 0 ? counts_.complete : counts_.healed);
  finished.push_back({body_time_, positions_});
}

void ShapeAssembly::take(const ShapePiece& piece, std::vector<Shape>& finished) {
  const std::size_t n = piece.positions.size();
  if (n == 0 || piece.first > positions_.size() || n > positions_.size() - piece.first) {
    ++counts_.misfits;
    return;
  }
  const bool newer = number_ == 0 || piece.body_time > body_time_ + kSameShape;
  if (!newer && (!open_ || piece.body_time < body_time_ - kSameShape)) {
    ++counts_.late_pieces;
    return;
  }
  if (newer) {
    if (open_) emit(finished);
    begin(piece.body_time);
  }
  for (std::size_t i = 0; i < n; ++i) {
    std::uint32_t& last = shape_of_[piece.first + i];
    if (last == number_) continue;
    if (last == 0) --unknown_;
    --missing_;
    last = number_;
    positions_[piece.first + i] = piece.positions[i].cast<float>();
  }
  if (missing_ == 0) emit(finished);
}

}  // namespace palpate
