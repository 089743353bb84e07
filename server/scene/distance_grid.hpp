// Signed distance of a rigid part, negative inside, from its values phi_ijk on a regular grid that turns with the part:
//
//     phi(p) = sum_ijk w_i(u_x) w_j(u_y) w_k(u_z) phi_ijk,     u = R^T (p - o) / h by axis,   w the quadratic B-spline
//     w_(i-1), w_i, w_(i+1) = (1/2 - t)^2 / 2,  3/4 - t^2,  (1/2 + t)^2 / 2,     i = round(u), t = u - i
//
// phi and its gradient are continuous, so a force along the gradient has no steps and is that of a potential. A plane is exact;
// a sphere of radius r comes out h^2 / (4 r) too small, and an edge is rounded over about h.
//
// Units: p, o, h, phi m; R a rotation; frame W. Errors: a point beyond the grid has no distance, it is outside the part.
// Source: de Boor, A Practical Guide to Splines (1978), chapter IX.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

class DistanceGrid {
 public:
  struct At {
    double distance_m = 0;
    Vec3 gradient = Vec3::Zero();  ///< outwards, of a length near 1
  };

  DistanceGrid() = default;
  /// Samples `distance` on a grid around the box low ... high of the frame with axes R and origin o, with at most about
  /// `most_points`.
  DistanceGrid(const Mat3& rotation, const Vec3& origin, const Vec3& low, const Vec3& high, double most_points,
               const std::function<double(const Vec3&)>& distance);

  /// Returns none beyond the grid.
  std::optional<At> at(const Vec3& p) const noexcept;
  const Vec3& spacing_m() const { return spacing_; }

 private:
  Mat3 inverse_ = Mat3::Identity();  // R^T
  Vec3 first_ = Vec3::Zero();        // R^T o plus the first point
  Vec3 spacing_ = Vec3::Ones();
  std::array<int, 3> points_{};
  std::vector<float> values_;  // x fastest
};

}  // namespace palpate
