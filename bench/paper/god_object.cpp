#include "bench/paper/god_object.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <optional>

namespace palpate {
namespace {

struct Plane {
  Vec3 normal;
  double offset = 0;  ///< n . g of a point on it, clearance included
};

struct Hit {
  double share = 1;  ///< share of the path
  Plane plane;
};

/// First entry into the body on the path from `a` to `b`.
std::optional<Hit> first_hit(const RigidBody& body, const Vec3& a, const Vec3& b) {
  const Positions x(body.vertices);
  const Vec3 way = b - a;
  std::optional<Hit> first;
  for (const Triangle& t : body.surface.view().triangles) {
    const Vec3 p = vertex(x, t[0]), u = vertex(x, t[1]) - p, v = vertex(x, t[2]) - p, area = u.cross(v);
    const double against = -way.dot(area);
    if (against <= 0) continue;
    const double share = (a - p).dot(area) / against;
    if (share < 0 || share > (first ? first->share : 1)) continue;
    const Vec3 q = a + share * way - p;
    const double area2 = area.squaredNorm(), wu = q.cross(v).dot(area) / area2, wv = u.cross(q).dot(area) / area2;
    if (wu < 0 || wv < 0 || wu + wv > 1) continue;
    const Vec3 n = area.normalized();
    first = Hit{share, {n, n.dot(p) + GodObject::kClearanceM}};
  }
  return first;
}

/// Point on all planes nearest to h; empty if they have none in common.
std::optional<Vec3> nearest_on(const std::array<Plane, 3>& planes, int count, const Vec3& h) {
  if (count == 0) return h;
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> n(3, count);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> d(count);
  for (int k = 0; k < count; ++k) {
    n.col(k) = planes[static_cast<std::size_t>(k)].normal;
    d[k] = planes[static_cast<std::size_t>(k)].offset;
  }
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> gram = n.transpose() * n;
  if (gram.determinant() < 1e-9) return std::nullopt;
  return Vec3(h + n * gram.inverse() * (d - n.transpose() * h));
}

}  // namespace

RigidBody box(const Vec3& low, const Vec3& high) {
  RigidBody body;
  for (unsigned i = 0; i < 8; ++i)
    for (unsigned axis = 0; axis < 3; ++axis)
      body.vertices.push_back((i >> axis & 1U ? high : low)[static_cast<Eigen::Index>(axis)]);
  body.surface = Surface({{0, 2, 3},
                          {0, 3, 1},
                          {4, 5, 7},
                          {4, 7, 6},
                          {0, 1, 5},
                          {0, 5, 4},
                          {2, 6, 7},
                          {2, 7, 3},
                          {0, 4, 6},
                          {0, 6, 2},
                          {1, 3, 7},
                          {1, 7, 5}},
                         8);
  return body;
}

const Vec3& GodObject::follow(const Vec3& tool) {
  std::array<Plane, 3> planes;
  constraints_ = 0;
  for (;;) {
    const auto goal = nearest_on(planes, constraints_, tool);
    if (!goal) return position_;
    const auto hit = first_hit(*body_, position_, *goal);
    if (!hit) return position_ = *goal;
    position_ += hit->share * (*goal - position_);
    position_ += (hit->plane.offset - hit->plane.normal.dot(position_)) * hit->plane.normal;
    if (constraints_ == 3) return position_;
    planes[static_cast<std::size_t>(constraints_++)] = hit->plane;
  }
}

Vec3 GodObject::force(const Vec3& tool, double stiffness_n_m) const {
  return constraints_ > 0 ? Vec3(stiffness_n_m * (position_ - tool)) : Vec3(Vec3::Zero());
}

Vec3 penalty_force(const RigidBody& body, const Vec3& tool, double stiffness_n_m) {
  const NearestPoint p = nearest_point(body.surface.view(), body.vertices, tool);
  return p.height_m < 0 ? Vec3(stiffness_n_m * (p.position - tool)) : Vec3(Vec3::Zero());
}

}  // namespace palpate
