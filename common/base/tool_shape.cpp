#include "common/base/tool_shape.hpp"

#include <cmath>

namespace palpate {

Vec3 ToolSphere::centre_at(double opening) const {
  if (!on_jaw()) return centre + Vec3(0, 0, opening * slide_m);
  const double angle = opening * swing_rad, c = std::cos(angle), s = std::sin(angle), up = centre.z() - hinge_m;
  return {c * centre.x() - s * up, centre.y(), hinge_m + s * centre.x() + c * up};
}

Vec3 ToolSphere::swept(double opening) const {
  if (!on_jaw()) return {0, 0, slide_m};
  const Vec3 at = centre_at(opening);
  return swing_rad * Vec3(hinge_m - at.z(), 0, at.x());
}

double grip_of(const ToolSphere& sphere, const Rotation& turn, const Vec3& arm, const Vec3& force) {
  if (!sphere.opens()) return 0;
  const Vec3 at = turn.conjugate() * arm, f = turn.conjugate() * force;
  if (!sphere.on_jaw()) return sphere.slide_m * f.z();
  return sphere.swing_rad * ((sphere.hinge_m - at.z()) * f.x() + at.x() * f.z());
}

}  // namespace palpate
