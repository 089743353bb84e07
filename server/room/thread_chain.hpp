// The free part of a thread, from a bite to a hand or to its end, as it is seen: an inextensible chain of particles without
// bending stiffness, under gravity and drag. It exerts no force: what a hand feels is the law of the thread (suture.hpp).
//
//     x'' = g - x' / t_d,   |x_(i+1) - x_i| = s,   s = L / (N - 1)
//
// in steps of kStepS: positions are moved freely, then back along the directions of the segments, each particle with the same
// mass, until every segment has its length to kTolerance (Newton's method on the multipliers of the segments, whose matrix is
// tridiagonal). Ends that are held do not yield. A chain whose ends are further apart than it is long is a straight line.
//
// Shapes and units: x 3 [m], g 3 [m/s^2], s, L [m], t_d [s].
// What can go wrong: it passes through bodies, parts and itself.
// Source: position-based dynamics, Mueller, Heidelberger, Hennix and Ratcliff, J. Vis. Comun. Image Represent. 18 (2007); of the
// direct solve for a chain, Deul, Kugelstadt, Weiler and Bender, Computer Graphics Forum 37 (2018).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

class ThreadChain {
 public:
  static constexpr double kSpacingM = 0.0025, kStepS = 0.005, kTolerance = 1e-4, kDragS = 0.1;

  /// Straight, from `bite` on along `direction`, with particles kSpacingM apart.
  ThreadChain(const Vec3& bite, const Vec3& direction, double length_m);
  /// Straight, from `bite` to `end`, with this number of segments.
  ThreadChain(const Vec3& bite, const Vec3& end, int segments);
  /// Lays it straight between two places, at rest.
  void lay(const Vec3& bite, const Vec3& end);
  /// Lays it over these places, one for each of its points, at rest.
  void lay(std::span<const Vec3> places);
  /// Moves on by `over_s`; `hand`: where its end is held at the end of that time, none if it is free.
  void advance(double over_s, const Vec3& bite, const std::optional<Vec3>& hand, double length_m, const Vec3& gravity_m_s2);
  const std::vector<Vec3>& points() const { return x_; }

 private:
  void keep_lengths(bool held, double segment_m);

  std::vector<Vec3> x_, v_;
  std::vector<double> below_, pivots_, rest_;  // of the tridiagonal solve
};

}  // namespace palpate
