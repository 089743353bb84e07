#include "server/scene/mesh_solid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

namespace palpate {

namespace {

constexpr std::uint32_t kLeafTriangles = 4;

/// Nearest point of a triangle and the part it lies on: 0-2 corner, 3-5 edge i to i + 1, 6 inside.
struct Foot {
  Vec3 point;
  int part;
};

Foot nearest_on_edge(const std::array<Vec3, 3>& x, int i, const Vec3& p) {
  const Vec3 &a = x[static_cast<std::size_t>(i)], &b = x[static_cast<std::size_t>((i + 1) % 3)];
  const double t = (p - a).dot(b - a) / (b - a).squaredNorm();
  if (t <= 0) return {a, i};
  if (t >= 1) return {b, (i + 1) % 3};
  return {a + t * (b - a), 3 + i};
}

Foot nearest_on_triangle(const std::array<Vec3, 3>& x, const Vec3& p) {
  const Vec3 n = (x[1] - x[0]).cross(x[2] - x[0]);
  bool inside = n.squaredNorm() > 0;
  for (std::size_t i = 0; i < 3 && inside; ++i) inside = n.cross(x[(i + 1) % 3] - x[i]).dot(p - x[i]) > 0;
  if (inside) return {p - n * (n.dot(p - x[0]) / n.squaredNorm()), 6};
  Foot best = nearest_on_edge(x, 0, p);
  for (int i = 1; i < 3; ++i) {
    const Foot foot = nearest_on_edge(x, i, p);
    if ((foot.point - p).squaredNorm() < (best.point - p).squaredNorm()) best = foot;
  }
  return best;
}

class MeshSolid final : public Solid {
 public:
  explicit MeshSolid(TriangleMesh mesh) : mesh_(std::move(mesh)) {
    compute_normals();
    order_.resize(mesh_.triangles.size());
    std::iota(order_.begin(), order_.end(), 0u);
    build(0, static_cast<std::uint32_t>(order_.size()));
  }

  double distance(const Vec3& p) const override {
    const Hit hit = find(p);
    const Vec3 away = p - hit.foot.point;
    return away.dot(normals_[hit.triangle][static_cast<std::size_t>(hit.foot.part)]) < 0 ? -away.norm() : away.norm();
  }
  Vec3 nearest(const Vec3& p) const override { return find(p).foot.point; }
  Eigen::AlignedBox3d bounds() const override { return boxes_[0].box; }

 private:
  struct Hit {
    std::uint32_t triangle = 0;
    Foot foot{};
    double squared = std::numeric_limits<double>::infinity();
  };
  struct Box {
    Eigen::AlignedBox3d box;
    std::uint32_t first = 0, count = 0;  ///< of order_, for a leaf
    std::uint32_t left = 0, right = 0;   ///< of boxes_, when count is 0
  };

  std::array<Vec3, 3> corners(std::uint32_t t) const {
    const Triangle& v = mesh_.triangles[t];
    return {mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]};
  }

  /// normals_[t]: corners (each face weighted by its angle there), edges (sum of both faces), face.
  void compute_normals() {
    std::vector<Vec3> at_vertex(mesh_.vertices.size(), Vec3::Zero());
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> at_edge;
    normals_.resize(mesh_.triangles.size());
    const auto edge = [](std::uint32_t a, std::uint32_t b) { return std::pair(std::min(a, b), std::max(a, b)); };
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto x = corners(t);
      const Vec3 n = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
      normals_[t][6] = n;
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 u = x[(i + 1) % 3] - x[i], v = x[(i + 2) % 3] - x[i];
        const auto a = mesh_.triangles[t][i], b = mesh_.triangles[t][(i + 1) % 3];
        at_vertex[a] += std::atan2(u.cross(v).norm(), u.dot(v)) * n;
        at_edge.try_emplace(edge(a, b), Vec3::Zero()).first->second += n;
      }
    }
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto a = mesh_.triangles[t][i], b = mesh_.triangles[t][(i + 1) % 3];
        normals_[t][i] = at_vertex[a];
        normals_[t][3 + i] = at_edge.at(edge(a, b));
      }
    }
  }

  std::uint32_t build(std::uint32_t first, std::uint32_t last) {
    const auto self = static_cast<std::uint32_t>(boxes_.size());
    Box node;
    for (std::uint32_t i = first; i < last; ++i) {
      for (const Vec3& x : corners(order_[i])) node.box.extend(x);
    }
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

  Hit find(const Vec3& p) const {
    Hit best;
    visit(0, p, best);
    return best;
  }

  void visit(std::uint32_t index, const Vec3& p, Hit& best) const {
    const Box& node = boxes_[index];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Foot foot = nearest_on_triangle(corners(order_[i]), p);
      const double squared = (foot.point - p).squaredNorm();
      if (squared < best.squared) best = {order_[i], foot, squared};
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

  TriangleMesh mesh_;
  std::vector<std::array<Vec3, 7>> normals_;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_;
};

}  // namespace

std::unique_ptr<Solid> make_mesh_solid(TriangleMesh mesh) { return std::make_unique<MeshSolid>(std::move(mesh)); }

}  // namespace palpate
