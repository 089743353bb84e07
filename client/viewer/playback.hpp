// Selects the moment to show: shapes and tools arrive at the server's frame rate, pictures are drawn at the display's.
//
// A shape of body time b that arrives at a is late by a - b; the least lateness of the last seconds, L, is a path without
// queueing. At the time t the moment shown is  b(t) = t - L - delay(),  interpolated between the two shapes around it, so motion
// is smooth while shapes arrive within delay(): one frame period for the interpolation plus a margin for jitter. Nothing is
// extrapolated: when shapes stop, the last one stays. This needs no common clock, only equal rates.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "client/viewer/shape_assembly.hpp"

namespace palpate {

class Playback {
 public:
  void clear();
  void add(Shape shape, Micros now);
  /// Adds vertices at the end of all shapes, as ShapeAssembly::extend(); `rest`: of all vertices.
  void extend(const std::vector<Eigen::Vector3f>& rest, const std::vector<std::uint32_t>& like);
  void add(const Tools& tools, Micros now);

  bool empty() const { return shapes_.empty(); }
  /// Returns shape and tools of the moment that is due; false while there is no shape.
  bool at(Micros now, Shape& shape, std::vector<ToolView>& tools) const;
  /// Body time of the moment shown at `now`; only with a shape.
  Micros moment(Micros now) const { return now - latenesses_.front().value - delay(); }
  Micros delay() const { return period_ + kJitterMargin; }
  Micros period() const { return period_; }
  /// Returns the shape of this body time within 5 ms; nullptr when there is none.
  const Shape* frame_at(Micros body_time) const;
  /// The newest shapes received, in order of body time.
  const std::deque<Shape>& shapes() const { return shapes_; }
  const std::deque<Tools>& tools() const { return tools_; }

 private:
  static constexpr std::size_t kKept = 16;
  static constexpr Micros kJitterMargin{15'000};
  static constexpr Micros kBreak{2'000'000};   ///< a jump of body time after which the past is discarded
  static constexpr Micros kForget{5'000'000};  ///< window of the least lateness

  struct Lateness {
    Micros at, value;
  };
  void watch_lateness(Micros body_time, Micros now);

  std::deque<Shape> shapes_;
  std::deque<Tools> tools_;
  std::deque<Lateness> latenesses_;  ///< values ascending: the first is the least of the last kForget
  Micros period_{50'000};
};

}  // namespace palpate
