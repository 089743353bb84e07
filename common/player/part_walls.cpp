#include "common/player/part_walls.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

PartWalls::PartWalls(std::span<const TriangleMesh> parts, std::span<const double> friction, const ToolShape& tool,
                     double stiffness_n_m)
    : tool_(tool.empty() ? ToolShape(1) : tool), stiffness_n_m_(stiffness_n_m) {
  for (std::size_t i = 0; i < parts.size() && walls_.size() < kMostWalls; ++i)
    if (!parts[i].triangles.empty()) walls_.push_back({TriangleTree(parts[i]), friction[i]});
}

Wrench PartWalls::push(const ToolPose& tool, double most_n_m, WallTouches& touches) const noexcept {
  Wrench sum;
  const double stiffness = std::min(stiffness_n_m_, most_n_m);
  for (std::size_t i = 0; i < walls_.size(); ++i)
    for (std::size_t j = 0; j < tool_.size(); ++j) {
      const Vec3 arm = tool.arm_of(tool_[j]);
      const Vec3 force = push(walls_[i], tool.position + arm, tool_[j].radius_m, stiffness, touches.of[i][j]);
      sum.force += force;
      sum.torque += arm.cross(force);
    }
  return sum;
}

/// Returns false if the sphere cannot touch the wall; renews c, q and s otherwise.
bool PartWalls::locate(const Wall& wall, const Vec3& centre, double radius_m, WallTouches::Touch& touch) const noexcept {
  if (wall.tree.bounds().squaredExteriorDistance(centre) > radius_m * radius_m) return false;
  const double known_m = std::abs(touch.distance_m), moved_m = (centre - touch.centre).norm();
  if (moved_m < touch.distance_m - radius_m) return false;
  const Vec3 nearest = known_m > 0 ? wall.tree.nearest(centre, touch.nearest) : wall.tree.nearest(centre);
  const bool inside = moved_m < known_m ? touch.distance_m < 0 : wall.tree.winding_number(centre) > 0.5;
  const double distance_m = (centre - nearest).norm();
  touch.centre = centre;
  touch.nearest = nearest;
  touch.distance_m = inside ? -distance_m : distance_m;
  return true;
}

Vec3 PartWalls::push(const Wall& wall, const Vec3& centre, double radius_m, double stiffness_n_m,
                     WallTouches::Touch& touch) const noexcept {
  constexpr double kNoDirectionM = 1e-9;  // on the surface: no contact this tick
  if (!locate(wall, centre, radius_m, touch) || !(touch.distance_m < radius_m)) {
    touch.was_outside = true;
    touch.touching = false;
    return Vec3::Zero();
  }
  const double depth_m = radius_m - touch.distance_m;
  if (!touch.was_outside || std::abs(touch.distance_m) < kNoDirectionM) return Vec3::Zero();
  const Vec3 normal = (centre - touch.nearest) / touch.distance_m;
  const Vec3 lowest = centre - radius_m * normal;
  if (!touch.touching) touch.anchor = lowest;
  touch.touching = true;
  Vec3 stretch = lowest - touch.anchor;
  stretch -= normal.dot(stretch) * normal;
  const double most_m = wall.friction * depth_m, stretched_m = stretch.norm();
  if (stretched_m > most_m) stretch *= most_m / stretched_m;
  touch.anchor = lowest - stretch;
  return stiffness_n_m * (depth_m * normal - stretch);
}

}  // namespace palpate
