#include "common/player/part_walls.hpp"

#include <algorithm>

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

Vec3 PartWalls::push(const Wall& wall, const Vec3& centre, double radius_m, double stiffness_n_m,
                     WallTouches::Touch& touch) const noexcept {
  constexpr double kNoDirectionM = 1e-9;  // on the surface: no contact this tick
  double depth_m = -1;
  Vec3 normal = Vec3::Zero();
  if (wall.tree.bounds().squaredExteriorDistance(centre) <= radius_m * radius_m) {
    const Vec3 away = centre - wall.tree.nearest(centre);
    const double distance_m = away.norm();
    const bool inside = wall.tree.winding_number(centre) > 0.5;
    depth_m = radius_m + (inside ? distance_m : -distance_m);
    if (distance_m > kNoDirectionM) normal = (inside ? -1 : 1) / distance_m * away;
  }
  if (!(depth_m > 0)) {
    touch = {true, false, {}};
    return Vec3::Zero();
  }
  if (!touch.was_outside || normal.isZero(0)) return Vec3::Zero();
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
