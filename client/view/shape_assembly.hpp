// Shapes of the body, each put together from the pieces of one body time.
//
// A shape whose pieces all came is complete. One that a newer shape overtakes is completed with the newest earlier positions
// of what is missing (lost pieces are healed by later frames); before every vertex was heard of once, it is dropped.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

struct Shape {
  Micros body_time{};
  std::vector<Eigen::Vector3f> positions;  ///< of every vertex [m]
};

struct ShapeCounts {
  std::uint64_t complete = 0, healed = 0, dropped = 0;
  std::uint64_t late_pieces = 0, misfits = 0;
};

class ShapeAssembly {
 public:
  /// Pieces of one shape may differ by so much: their stamps are mapped to our clock one by one.
  static constexpr Micros kSameShape{500};

  void expect(std::uint32_t vertices);
  /// Takes one piece and appends the shapes that it finishes, none, one or two, to `finished` in order of time.
  void take(const ShapePiece& piece, std::vector<Shape>& finished);
  const ShapeCounts& counts() const { return counts_; }

 private:
  void begin(Micros body_time);
  void emit(std::vector<Shape>& finished);

  std::vector<Eigen::Vector3f> positions_;
  std::vector<std::uint32_t> shape_of_;  ///< number of the shape that a vertex was last heard of in, 0 = never
  std::uint32_t number_ = 0;
  std::size_t unknown_ = 0, missing_ = 0;  ///< vertices never heard of; not heard of in this shape
  Micros body_time_{};
  bool open_ = false;
  ShapeCounts counts_;
};

}  // namespace palpate
