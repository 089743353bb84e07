// Shapes of the body, assembled from the changes of each frame.
//
// A frame's pieces carry numbered blocks of vertices and their new values; the Tools after them carry the number of pieces. A
// frame whose pieces all arrived is complete. A frame that a newer one overtakes is shown with the pieces that arrived (the
// server sends the lost blocks again, with their values by then). A block never returns to an older frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

struct Shape {
  Micros body_time{};
  std::vector<Eigen::Vector3f> positions;  ///< position of every vertex [m]
  std::vector<float> scalars;              ///< value of every vertex in `channel`; empty: none
  ShapeChannel channel = ShapeChannel::position;
};

struct ShapeCounts {
  std::uint64_t complete = 0, healed = 0;
  std::uint64_t late_pieces = 0, misfits = 0;
  std::uint64_t bytes = 0;  ///< size of the blocks
};

class ShapeAssembly {
 public:
  /// Starts over with the body at rest, which a server assumes of a new viewer.
  void rest(const std::vector<MeshVertex>& vertices);
  /// Adds vertices at the end, each displaced like another until its own values arrive.
  void extend(const std::vector<MeshVertex>& vertices, const std::vector<std::uint32_t>& like);
  /// Returns true if all blocks of the piece are of vertices that are known.
  bool fits(const ShapePiece& piece) const;
  /// Selects the channel whose values go into shapes, position: none.
  void show(ShapeChannel channel) { shown_ = channel; }

  /// Processes one message and appends the shapes that it completes, none, one or two, to `finished` in order of time.
  void take(const ShapePiece& piece, std::vector<Shape>& finished);
  void take(const Tools& tools, std::vector<Shape>& finished);
  const ShapeCounts& counts() const { return counts_; }

 private:
  bool reach(std::uint32_t frame, Micros body_time, std::vector<Shape>& finished);
  void apply(const ShapeBlock& block, const ShapePiece& piece);
  void emit(std::vector<Shape>& finished);

  std::vector<Eigen::Vector3f> rest_, positions_;
  std::array<std::vector<float>, kShapeChannels> fields_;                ///< [0] is not used
  std::array<std::vector<std::uint32_t>, kShapeChannels> block_frames_;  ///< frame in which a block was last received, 0 = never
  ShapeChannel shown_ = ShapeChannel::position;
  std::uint32_t frame_ = 0;  ///< 0: none yet
  Micros body_time_{};
  std::uint32_t came_ = 0, expected_ = 0;  ///< pieces of this frame; expected_ is 0 until Tools arrive, then counts Tools as well
  bool open_ = false;
  ShapeCounts counts_;
};

}  // namespace palpate
