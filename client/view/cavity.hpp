// Where a deformed surface is hollow: its indentations get less light from around, as by ambient occlusion, for the price of a
// few products a vertex.
//
// Of the body at rest, around each vertex i, the vertices are found that lie nearest to the distance R in each of kSectors
// directions along the surface. Of the deformed body, with normals n,
//
//     cavity_i = mean over these j of clamp(R n_i . (x_j - x_i) / |x_j - x_i|^2, -1, 1):
//
// how far the surface at R rises above the tangent plane, as a share of R; about R times the mean curvature over 2, positive in
// an indentation and negative on a ridge. It is the same for a coarse and for a fine mesh of one surface.
#pragma once

#include <span>
#include <vector>

#include "client/view/surface.hpp"

namespace palpate {

class Cavity {
 public:
  static constexpr float kReach = 0.07F;  ///< R over the diagonal of the body
  static constexpr std::size_t kSectors = 8;
  static constexpr std::size_t kMostVisited = 256;  ///< vertices looked at around each: on a very fine mesh R is what they reach

  /// Of this body from now on; `triangles` index into `rest`.
  void prepare(std::span<const Triangle> triangles, std::span<const Vec3f> rest);
  /// As many positions and normals as there were rest positions. 0 for a vertex without a triangle.
  void measure(std::span<const Vec3f> positions, std::span<const Vec3f> normals, std::vector<float>& cavity) const;

 private:
  float reach_m_ = 0;
  std::vector<std::uint32_t> around_, begin_;  ///< of vertex i: around_[begin_[i]] up to begin_[i + 1]
};

}  // namespace palpate
