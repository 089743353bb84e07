// The depth of points in a solid.
#pragma once

#include <span>

#include "common/base/types.hpp"
#include "server/scene/signed_distance.hpp"

namespace palpate {

struct Overlap {
  double depth_m = 0;  ///< 0: none of them is inside
  Vec3 place = Vec3::Zero();
};

/// Returns the deepest of these points.
inline Overlap deepest(const SignedDistance& solid, std::span<const Vec3> points) {
  Overlap most;
  for (const Vec3& p : points) {
    if (!solid.bounds().contains(p)) continue;
    if (const double depth_m = -solid.distance(p); depth_m > most.depth_m) most = {depth_m, p};
  }
  return most;
}

}  // namespace palpate
