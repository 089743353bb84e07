#include "client/view/pointer_tool.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Shares of the body's diagonal.
constexpr float kHover = 0.05F, kDepth = 0.045F, kLeastDepth = 0.005F, kMostDepth = 0.15F, kDepthStep = 0.006F;
constexpr float kMostLift = 0.12F, kLiftAWay = 0.6F;  // kLiftAWay: for a path as long as the height of the picture

struct Ray {
  Vec3f from, direction;
};

Ray ray_of(const Camera& camera, const Pointer& pointer) {
  const Eigen::Matrix4f back = (camera.projection(pointer.width / pointer.height) * camera.view()).inverse();
  const float x = 2 * pointer.x / pointer.width - 1, y = 1 - 2 * pointer.y / pointer.height;
  const auto at = [&](float depth) -> Vec3f { return (back * Eigen::Vector4f(x, y, depth, 1)).hnormalized(); };
  const Vec3f near = at(-1);
  return {near, (at(1) - near).normalized()};
}

/// Returns the intersection of a ray with the plane through a point across the camera's line of sight.
Vec3f on_plane(const Ray& ray, const Camera& camera, const Vec3f& through) {
  const Vec3f back = camera.axes().col(2);
  return ray.from + ray.direction * ((through - ray.from).dot(back) / ray.direction.dot(back));
}

}  // namespace

// T. Moeller and B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
std::optional<RayHit> first_hit(std::span<const Triangle> triangles, std::span<const Vec3f> positions, const Vec3f& from,
                                const Vec3f& direction) {
  std::optional<RayHit> hit;
  float nearest = 0;
  for (const Triangle& t : triangles) {
    const Vec3f a = positions[t[1]] - positions[t[0]], b = positions[t[2]] - positions[t[0]], p = direction.cross(b);
    const float determinant = a.dot(p);
    if (!(std::abs(determinant) > 1e-12F)) continue;
    const Vec3f s = (from - positions[t[0]]) / determinant, q = s.cross(a);
    const float u = s.dot(p), v = direction.dot(q), far = b.dot(q);
    if (u < 0 || v < 0 || u + v > 1 || far < 0 || (hit && far >= nearest)) continue;
    nearest = far;
    hit = {from + far * direction, a.cross(b).normalized()};
  }
  return hit;
}

PointerTool::PointerTool(std::span<const Triangle> triangles, std::span<const Vec3f> rest, ContactKind contact, const Vec3& home)
    : triangles_(triangles),
      rest_(rest),
      contact_(contact),
      home_(home.cast<float>()),
      point_(home_),
      normal_(Vec3f::UnitZ()),
      size_(bounds(triangles, rest).diagonal()),
      depth_m_(kDepth * size_) {
  update_normals(triangles, rest, normals_);
  point_ -= kHover * size_ * normal_;  // the tool begins at home
}

void PointerTool::deepen(float steps) {
  depth_m_ = std::clamp(depth_m_ + steps * kDepthStep * size_, kLeastDepth * size_, kMostDepth * size_);
}

Vec3 PointerTool::target(const Camera& camera, const Pointer& pointer, Micros elapsed) {
  return (contact_ == ContactKind::attach ? pull(camera, pointer) : press(camera, pointer, elapsed)).cast<double>();
}

/// Returns the mean normal of the vertices within reach: a stroke over the edges of a coarse mesh must not jerk the tool.
Vec3f PointerTool::smooth_normal(const Vec3f& point, const Vec3f& flat) const {
  const float reach = 0.08F * size_;
  Vec3f sum = 1e-3F * flat;
  for (const Triangle& t : triangles_)
    for (const std::uint32_t v : t) {
      const float d = (rest_[v] - point).norm() / reach;
      if (d < 1) sum += (1 - d * d) * (1 - d * d) * normals_[v];
    }
  return sum.normalized();
}

/// Returns the pointer, or the point towards it that the tool may reach now from its present place. `held` on arrival.
Pointer PointerTool::walk(const Camera& camera, const Pointer& pointer, Micros elapsed) {
  constexpr Micros kMost{50'000};  // no leap after a pause
  const Eigen::Matrix4f view_projection = camera.projection(pointer.width / pointer.height) * camera.view();
  const Vec3f now = to_pixels(view_projection, point_, pointer.width, pointer.height);
  const Eigen::Vector2f way = Eigen::Vector2f(pointer.x, pointer.y) - now.head<2>();
  const float most = kWalk * static_cast<float>(seconds(std::min(elapsed, kMost))) * pointer.height;
  lift_ = std::min(kMostLift, kLiftAWay * way.norm() / pointer.height);
  if (now.z() > 1 || way.norm() <= most) return pointer;
  const Eigen::Vector2f at = now.head<2>() + way * (most / way.norm());
  return {at.x(), at.y(), pointer.width, pointer.height, false};
}

Vec3f PointerTool::press(const Camera& camera, const Pointer& pointer, Micros elapsed) {
  const Pointer walked = walk(camera, pointer, elapsed);
  const Ray ray = ray_of(camera, walked);
  if (const auto hit = first_hit(triangles_, rest_, ray.from, ray.direction)) {
    point_ = hit->point;
    normal_ = smooth_normal(hit->point, hit->normal);
  } else {
    point_ = on_plane(ray, camera, point_);
  }
  pressing_ = pointer.held && (pressing_ || walked.held);
  return point_ + (pressing_ ? -depth_m_ : (kHover + lift_) * size_) * normal_;
}

Vec3f PointerTool::pull(const Camera& camera, const Pointer& pointer) {
  if (!pointer.held) {
    taken_.reset();
    return home_;
  }
  const Vec3f at = on_plane(ray_of(camera, pointer), camera, home_);
  if (!taken_) taken_ = at;
  const Vec3f moved = at - *taken_;
  const float most = 0.4F * size_, far = moved.norm();
  return home_ + (far > most ? Vec3f(moved * (most / far)) : moved);
}

}  // namespace palpate
