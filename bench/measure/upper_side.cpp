#include "bench/measure/upper_side.hpp"

#include <Eigen/Geometry>
#include <limits>

#include "server/body/settle.hpp"

namespace palpate {
namespace {

/// Centre of the face of the upper side nearest to a point of the plane, without steep faces.
Vec3 nearest_upper_face(const LumpedBody& body, const Vec3& home) {
  constexpr double kSteep = 0.8;  // cosine against the vertical
  Vec3 nearest = home;
  double least = std::numeric_limits<double>::max();
  const std::vector<Vec3> at = vertices_at_rest(body);
  for (const Triangle& t : body.triangles) {
    const Vec3 &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
    const Vec3 normal = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3;
    const auto top = normal.z() >= kSteep ? height_above(body, middle.x(), middle.y()) : std::nullopt;
    const double distance = (middle - home).head<2>().norm();
    if (!top || *top > middle.z() + 1e-6 || distance >= least) continue;
    least = distance;
    nearest = middle;
  }
  return nearest;
}

}  // namespace

Scene as_it_hangs(Scene scene) {
  if (scene.body.gravity_m_s2.squaredNorm() == 0) return scene;
  const Dynamics dynamics(scene.body);
  const Vector x = settled_state(dynamics, scene.name).x;
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) scene.body.nodes[i] = at_node(x, i);
  return scene;
}

std::optional<double> height_above(const LumpedBody& body, double x, double y) {
  std::optional<double> top;
  const std::vector<Vec3> at = vertices_at_rest(body);
  for (const Triangle& t : body.triangles) {
    const Vec3 &a = at[t[0]], &b = at[t[1]], &c = at[t[2]];
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (area <= 0) continue;  // seen from below
    const double u = ((x - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (y - a.y())) / area;
    const double v = ((b.x() - a.x()) * (y - a.y()) - (x - a.x()) * (b.y() - a.y())) / area;
    constexpr double kEdge = 1e-9;
    if (u < -kEdge || v < -kEdge || u + v > 1 + kEdge) continue;
    const double z = a.z() + u * (b.z() - a.z()) + v * (c.z() - a.z());
    if (!top || z > *top) top = z;
  }
  return top;
}

Vec3 place_below(const LumpedBody& body, const Vec3& home) {
  const auto top = height_above(body, home.x(), home.y());
  return top ? Vec3(home.x(), home.y(), *top) : nearest_upper_face(body, home);
}

}  // namespace palpate
