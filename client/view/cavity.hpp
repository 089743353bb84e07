// Concavity of a deformed surface: indentations receive less ambient light, as by ambient occlusion, for a few products a vertex.
//
// In the body at rest, around each vertex i, the vertices nearest to the distance R are found in each of kSectors directions
// along the surface. In the deformed body, with normals n,
//
//     cavity_i = mean over these j of clamp(R n_i . (x_j - x_i) / |x_j - x_i|^2, -1, 1):
//
// the height of the surface at distance R above the tangent plane, as a share of R; about R times the mean curvature over 2,
// positive in an indentation and negative on a ridge. It is the same for a coarse and for a fine mesh of one surface.
#pragma once

#include <span>
#include <vector>

#include "client/viewer/surface.hpp"

namespace palpate {

class Cavity {
 public:
  static constexpr float kReach = 0.07F;  ///< R over the diagonal of the body
  static constexpr std::size_t kSectors = 8;
  static constexpr std::size_t kMostVisited = 256;  ///< visited around each vertex; bounds R on a very fine mesh

  /// Prepares for a body; `triangles` index into `rest`.
  void prepare(std::span<const Triangle> triangles, std::span<const Vec3f> rest);
  /// Computes the cavity of each vertex, 0 for one without a triangle. There are as many positions and normals as rest positions.
  void measure(std::span<const Vec3f> positions, std::span<const Vec3f> normals, std::vector<float>& cavity) const;

 private:
  float reach_m_ = 0;
  std::vector<std::uint32_t> around_, begin_;  ///< neighbours of vertex i: around_[begin_[i]] up to begin_[i + 1]
};

}  // namespace palpate
