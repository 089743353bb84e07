// Shapes of the body, each put together from what one frame changed.
//
// A frame's pieces name blocks of vertices and what they are now; the Tools after them say how many pieces there were. A frame
// whose pieces all came is complete. One that a newer frame overtakes is shown with what came of it (the server sends again what
// was lost, as it is by then). A block is never put back to an older frame.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

struct Shape {
  Micros body_time{};
  std::vector<Eigen::Vector3f> positions;  ///< of every vertex [m]
  std::vector<float> scalars;              ///< of every vertex in `channel`; empty: none
  ShapeChannel channel = ShapeChannel::position;
};

struct ShapeCounts {
  std::uint64_t complete = 0, healed = 0;
  std::uint64_t late_pieces = 0, misfits = 0;
  std::uint64_t bytes = 0;  ///< of blocks
};

class ShapeAssembly {
 public:
  /// Start over with the body at rest, which is what a server takes a new viewer to have.
  void rest(const std::vector<MeshVertex>& vertices);
  /// The channel whose values go into shapes, position: none.
  void show(ShapeChannel channel) { shown_ = channel; }

  /// Take one message and append the shapes that it finishes, none, one or two, to `finished` in order of time.
  void take(const ShapePiece& piece, std::vector<Shape>& finished);
  void take(const Tools& tools, std::vector<Shape>& finished);
  const ShapeCounts& counts() const { return counts_; }

 private:
  bool reach(std::uint32_t frame, Micros body_time, std::vector<Shape>& finished);
  void apply(const ShapeBlock& block, const ShapePiece& piece);
  void emit(std::vector<Shape>& finished);

  std::vector<Eigen::Vector3f> rest_, positions_;
  std::array<std::vector<float>, kShapeChannels> fields_;                ///< [0] is not used
  std::array<std::vector<std::uint32_t>, kShapeChannels> block_frames_;  ///< in which a block was last heard of, 0 = never
  ShapeChannel shown_ = ShapeChannel::position;
  std::uint32_t frame_ = 0;  ///< 0: none yet
  Micros body_time_{};
  std::uint32_t came_ = 0, expected_ = 0;  ///< pieces of this frame; 0 until Tools tell, and then one more for themselves
  bool open_ = false;
  ShapeCounts counts_;
};

}  // namespace palpate
