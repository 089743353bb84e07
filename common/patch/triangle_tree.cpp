#include "common/patch/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace palpate {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;
constexpr double kFar = 3;  // distance, in radii of a box, beyond which its triangles count as one dipole

Vec3 nearest_on_edge(const Vec3& a, const Vec3& b, const Vec3& p) {
  const double t = (p - a).dot(b - a) / (b - a).squaredNorm();
  return t <= 0 ? a : t >= 1 ? b : Vec3(a + t * (b - a));
}

Vec3 nearest_on_triangle(const std::array<Vec3, 3>& x, const Vec3& p) {
  const Vec3 n = (x[1] - x[0]).cross(x[2] - x[0]);
  bool inside = n.squaredNorm() > 0;
  for (std::size_t i = 0; i < 3 && inside; ++i) inside = n.cross(x[(i + 1) % 3] - x[i]).dot(p - x[i]) > 0;
  if (inside) return p - n * (n.dot(p - x[0]) / n.squaredNorm());
  Vec3 best = nearest_on_edge(x[0], x[1], p);
  for (std::size_t i = 1; i < 3; ++i) {
    const Vec3 foot = nearest_on_edge(x[i], x[(i + 1) % 3], p);
    if ((foot - p).squaredNorm() < (best - p).squaredNorm()) best = foot;
  }
  return best;
}

/// Van Oosterom and Strackee (1983): positive if the triangle is clockwise as seen from p.
double solid_angle_of(const std::array<Vec3, 3>& x, const Vec3& p) {
  const Vec3 a = x[0] - p, b = x[1] - p, c = x[2] - p;
  const double u = a.norm(), v = b.norm(), w = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), u * v * w + a.dot(b) * w + b.dot(c) * u + c.dot(a) * v);
}

}  // namespace

TriangleTree::TriangleTree(TriangleMesh mesh) : mesh_(std::move(mesh)) {
  order_.resize(mesh_.triangles.size());
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, static_cast<std::uint32_t>(order_.size()));
}

Vec3 TriangleTree::nearest(const Vec3& p) const {
  Hit best{p, std::numeric_limits<double>::infinity()};
  visit(0, p, best);
  return best.point;
}

Vec3 TriangleTree::nearest(const Vec3& p, const Vec3& candidate) const {
  Hit best{candidate, (candidate - p).squaredNorm()};
  visit(0, p, best);
  return best.point;
}

double TriangleTree::winding_number(const Vec3& p) const { return solid_angle(0, p) / (4 * std::numbers::pi); }

std::array<Vec3, 3> TriangleTree::corners(std::uint32_t t) const {
  const Triangle& v = mesh_.triangles[t];
  return {mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]};
}

std::uint32_t TriangleTree::build(std::uint32_t first, std::uint32_t last) {
  const auto self = static_cast<std::uint32_t>(boxes_.size());
  Box node;
  for (std::uint32_t i = first; i < last; ++i)
    for (const Vec3& x : corners(order_[i])) node.box.extend(x);
  take_dipole(node, first, last);
  boxes_.push_back(node);
  if (last - first <= kLeafTriangles) {
    boxes_[self].first = first;
    boxes_[self].count = last - first;
    return self;
  }
  Eigen::Index axis;
  node.box.sizes().maxCoeff(&axis);
  const auto centre = [&](std::uint32_t t) {
    const auto x = corners(t);
    return x[0][axis] + x[1][axis] + x[2][axis];
  };
  const std::uint32_t middle = first + (last - first) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](auto a, auto b) { return std::pair(centre(a), a) < std::pair(centre(b), b); });
  const auto left = build(first, middle), right = build(middle, last);
  boxes_[self].left = left;
  boxes_[self].right = right;
  return self;
}

void TriangleTree::take_dipole(Box& node, std::uint32_t first, std::uint32_t last) const {
  double whole = 0;
  for (std::uint32_t i = first; i < last; ++i) {
    const auto x = corners(order_[i]);
    const Vec3 area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
    node.area += area;
    node.centre += area.norm() * (x[0] + x[1] + x[2]) / 3;
    whole += area.norm();
  }
  node.centre = whole > 0 ? Vec3(node.centre / whole) : node.box.center();
  node.reach = (node.box.center() - node.centre).norm() + 0.5 * node.box.diagonal().norm();
}

void TriangleTree::visit(std::uint32_t index, const Vec3& p, Hit& best) const {
  const Box& node = boxes_[index];
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    const Vec3 foot = nearest_on_triangle(corners(order_[i]), p);
    const double squared = (foot - p).squaredNorm();
    if (squared < best.squared) best = {foot, squared};
  }
  if (node.count > 0) return;
  std::uint32_t near = node.left, far = node.right;
  double near_squared = boxes_[near].box.squaredExteriorDistance(p), far_squared = boxes_[far].box.squaredExteriorDistance(p);
  if (far_squared < near_squared) {
    std::swap(near, far);
    std::swap(near_squared, far_squared);
  }
  if (near_squared < best.squared) visit(near, p, best);
  if (far_squared < best.squared) visit(far, p, best);
}

double TriangleTree::solid_angle(std::uint32_t index, const Vec3& p) const {
  const Box& node = boxes_[index];
  const Vec3 away = node.centre - p;
  const double distance = away.norm();
  if (distance > kFar * node.reach) return node.area.dot(away) / (distance * distance * distance);
  if (node.count == 0) return solid_angle(node.left, p) + solid_angle(node.right, p);
  double sum = 0;
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) sum += solid_angle_of(corners(order_[i]), p);
  return sum;
}

}  // namespace palpate
