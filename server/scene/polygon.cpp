
#include "server/scene/surface_file.hpp"

namespace palpate {
namespace {

using Point = Eigen::Vector2d;

double twice_area(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Projects the corners to the plane normal to the polygon's mean normal, counter-clockwise.
std::vector<Point> flattened(std::span<const std::uint32_t> polygon, std::span<const Vec3> x) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i)
    normal += (x[polygon[i]] - x[polygon[0]]).cross(x[polygon[(i + 1) % polygon.size()]] - x[polygon[0]]);
  Eigen::Index up = 0;
  normal.cwiseAbs().maxCoeff(&up);
  const Eigen::Index u = (up + 1) % 3, v = (up + 2) % 3;
  std::vector<Point> flat;
  for (const std::uint32_t corner : polygon)
    flat.push_back(normal[up] < 0 ? Point(x[corner][v], x[corner][u]) : Point(x[corner][u], x[corner][v]));
  return flat;
}

/// The remaining polygon, as a ring of corners.
class Ring {
 public:
  explicit Ring(std::vector<Point> flat)
      : flat_(std::move(flat)), before_(flat_.size()), after_(flat_.size()), ear_(flat_.size()) {
    const std::size_t n = flat_.size();
    for (std::size_t i = 0; i < n; ++i) {
      before_[i] = (i + n - 1) % n;
      after_[i] = (i + 1) % n;
    }
    for (std::size_t i = 0; i < n; ++i) ear_[i] = is_ear(i);
  }

  /// Returns the next ear from `i` on; `i` itself if there is none.
  std::size_t ear_from(std::size_t i, std::size_t left) const {
    std::size_t at = i;
    for (; left > 0; --left, at = after_[at])
      if (ear_[at]) return at;
    return i;
  }
  std::size_t before(std::size_t i) const { return before_[i]; }
  std::size_t after(std::size_t i) const { return after_[i]; }
  void cut(std::size_t i) {
    after_[before_[i]] = after_[i];
    before_[after_[i]] = before_[i];
    for (const std::size_t neighbour : {before_[i], after_[i]}) ear_[neighbour] = is_ear(neighbour);
  }

 private:
  /// Returns true for a convex corner whose triangle contains no other corner.
  bool is_ear(std::size_t i) const {
    const Point &a = flat_[before_[i]], &b = flat_[i], &c = flat_[after_[i]];
    if (!(twice_area(a, b, c) > 0)) return false;
    for (std::size_t k = after_[after_[i]]; k != before_[i]; k = after_[k]) {
      const Point& p = flat_[k];
      if (p == a || p == b || p == c) continue;
      if (twice_area(a, b, p) >= 0 && twice_area(b, c, p) >= 0 && twice_area(c, a, p) >= 0) return false;
    }
    return true;
  }

  std::vector<Point> flat_;
  std::vector<std::size_t> before_, after_;
  std::vector<std::uint8_t> ear_;
};

}  // namespace

void cut_polygon(std::span<const std::uint32_t> polygon, std::span<const Vec3> x, std::vector<Triangle>& out) {
  if (polygon.size() == 3) {
    out.push_back({polygon[0], polygon[1], polygon[2]});
    return;
  }
  if (polygon.size() < 3) return;
  Ring ring(flattened(polygon, x));
  std::size_t at = 0;
  for (std::size_t left = polygon.size(); left > 2; --left) {
    const std::size_t ear = ring.ear_from(at, left);
    out.push_back({polygon[ring.before(ear)], polygon[ear], polygon[ring.after(ear)]});
    ring.cut(ear);
    at = ring.after(ring.after(ear));  // avoids fans
  }
}

}  // namespace palpate
