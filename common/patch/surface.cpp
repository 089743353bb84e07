#include "common/patch/surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace palpate {
namespace {

Vec3 area_normal(const SurfaceView& s, Positions x, std::uint32_t t) {
  const Triangle& tri = s.triangles[t];
  const Vec3 a = vertex(x, tri[0]);
  return (vertex(x, tri[1]) - a).cross(vertex(x, tri[2]) - a);
}

// Returns the barycentric weights of the point of triangle (a, b, c) nearest to p (Ericson, Real-Time Collision Detection, 5.1.5:
// by Voronoi region).
Vec3 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double v = d1 / (d1 - d3);
    return {1 - v, v, 0};
  }
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double w = d2 / (d2 - d6);
    return {1 - w, 0, w};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

struct Best {
  SurfacePoint point;
  double distance2 = std::numeric_limits<double>::infinity();

  void offer(const SurfaceView& s, Positions x, std::uint32_t t, const Vec3& query) {
    const Triangle& tri = s.triangles[t];
    const Vec3 a = vertex(x, tri[0]), b = vertex(x, tri[1]), c = vertex(x, tri[2]);
    // Most triangles are too far away by their bounding box.
    const Vec3 low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    const Vec3 outside = (low - query).cwiseMax(query - high).cwiseMax(Vec3::Zero());
    if (outside.squaredNorm() >= distance2) return;
    const Vec3 w = nearest_weights(a, b, c, query);
    const double d2 = (w[0] * a + w[1] * b + w[2] * c - query).squaredNorm();
    if (d2 < distance2) {
      distance2 = d2;
      point = {t, w};
    }
  }
  void offer_around(const SurfaceView& s, Positions x, std::uint32_t triangle, const Vec3& query) {
    const Triangle& corners = s.triangles[triangle];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::uint32_t k = s.first[corners[c]]; k < s.first[corners[c] + 1]; ++k) {
        const Triangle& t = s.triangles[s.incident[k]];
        bool offered = false;  // true: it is a neighbour of an earlier corner
        for (std::size_t e = 0; e < c; ++e) offered |= t[0] == corners[e] || t[1] == corners[e] || t[2] == corners[e];
        if (!offered) offer(s, x, s.incident[k], query);
      }
  }
};

NearestPoint describe_nearest(const SurfaceView& s, Positions x, const SurfacePoint& p, const Vec3& query) {
  NearestPoint n;
  n.point = p;
  n.position = position_at(s, x, p);
  n.normal = normal_at(s, x, p);
  // By the normal alone, points in front of a triangle that is turned inside out would count as inside, however far away.
  constexpr double kLeastWinding = 0.05;  // less than next to a corner of an open surface, 1/8
  const Vec3 away = query - n.position;
  const bool behind = away.dot(n.normal) < 0 && winding_number(s, x, query) > kLeastWinding;
  n.height_m = behind ? -away.norm() : away.norm();
  n.at_border = on_open_edge(s, p);
  return n;
}

}  // namespace

void connect_surface(std::span<const Triangle> triangles, std::size_t vertices, std::span<std::uint32_t> first,
                     std::span<std::uint32_t> incident, std::span<std::uint8_t> open) noexcept {
  assert(first.size() == vertices + 1 && incident.size() == 3 * triangles.size() && open.size() == triangles.size());
  std::fill(first.begin(), first.end(), 0);
  for (const Triangle& t : triangles)
    for (const std::uint32_t i : t) ++first[i + 1];
  for (std::size_t i = 0; i < vertices; ++i) first[i + 1] += first[i];
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t i : triangles[t]) incident[first[i]++] = t;
  for (std::size_t i = vertices; i > 0; --i) first[i] = first[i - 1];
  first[0] = 0;

  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    open[t] = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][(k + 1) % 3], b = triangles[t][(k + 2) % 3];
      bool shared = false;
      for (std::uint32_t e = first[a]; e < first[a + 1]; ++e) {
        const Triangle& other = triangles[incident[e]];
        shared |= incident[e] != t && std::find(other.begin(), other.end(), b) != other.end();
      }
      if (!shared) open[t] = static_cast<std::uint8_t>(open[t] | (1U << k));
    }
  }
}

Surface::Surface(std::vector<Triangle> triangles, std::size_t vertices)
    : triangles_(std::move(triangles)), first_(vertices + 1), incident_(3 * triangles_.size()), open_(triangles_.size()) {
  connect_surface(triangles_, vertices, first_, incident_, open_);
}

Vec3 position_at(const SurfaceView& s, Positions x, const SurfacePoint& p) noexcept {
  assert(p.triangle < s.triangles.size());
  const Triangle& t = s.triangles[p.triangle];
  return p.weight[0] * vertex(x, t[0]) + p.weight[1] * vertex(x, t[1]) + p.weight[2] * vertex(x, t[2]);
}

Vec3 vertex_normal(const SurfaceView& s, Positions x, std::uint32_t i) noexcept {
  assert(i + 1 < s.first.size() && (s.normal_correction.empty() || i < s.normal_correction.size()));
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t k = s.first[i]; k < s.first[i + 1]; ++k) sum += area_normal(s, x, s.incident[k]);
  const double norm = sum.norm();
  if (norm > 0) sum /= norm;
  return s.normal_correction.empty() ? sum : Vec3(sum + s.normal_correction[i]);
}

Vec3 normal_at(const SurfaceView& s, Positions x, const SurfacePoint& p) noexcept {
  assert(p.triangle < s.triangles.size());
  const Triangle& t = s.triangles[p.triangle];
  Vec3 n = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    if (p.weight[k] > 0) n += p.weight[k] * vertex_normal(s, x, t[static_cast<std::size_t>(k)]);
  const double norm = n.norm();
  if (norm > 0) return n / norm;
  n = area_normal(s, x, p.triangle);
  return n.norm() > 0 ? Vec3(n.normalized()) : Vec3::UnitZ();
}

std::optional<double> way_out(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, const Vec3& r) noexcept {
  const Vec3 way = b - a, to_q = q - p, to_r = r - p, normal = way.cross(to_r);
  const double volume = to_q.dot(normal);
  if (!(volume < 0)) return std::nullopt;
  const Vec3 from = a - p, other = from.cross(to_q);
  const double u = from.dot(normal) / volume, v = way.dot(other) / volume, t = to_r.dot(other) / volume;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1 ? std::optional(t) : std::nullopt;
}

double winding_number(const SurfaceView& s, Positions x, const Vec3& point) noexcept {
  double sum = 0;
  for (const Triangle& t : s.triangles) {
    const Vec3 a = vertex(x, t[0]) - point, b = vertex(x, t[1]) - point, c = vertex(x, t[2]) - point;
    const double ra = a.norm(), rb = b.norm(), rc = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), ra * rb * rc + a.dot(b) * rc + b.dot(c) * ra + c.dot(a) * rb);
  }
  return sum / (2 * std::numbers::pi);
}

bool on_open_edge(const SurfaceView& s, const SurfacePoint& p) noexcept {
  const auto open = [&](std::uint32_t triangle, int k) { return (s.open[triangle] >> k & 1) != 0; };
  for (int k = 0; k < 3; ++k)
    if (p.weight[k] <= 0 && open(p.triangle, k)) return true;
  // At a corner, the edges of all triangles around it.
  for (int k = 0; k < 3; ++k) {
    if (p.weight[(k + 1) % 3] > 0 || p.weight[(k + 2) % 3] > 0) continue;
    const std::uint32_t corner = s.triangles[p.triangle][static_cast<std::size_t>(k)];
    for (const std::uint32_t t : s.incident.subspan(s.first[corner], s.first[corner + 1] - s.first[corner]))
      for (int i = 0; i < 3; ++i)
        if (s.triangles[t][static_cast<std::size_t>(i)] != corner && open(t, i)) return true;
  }
  return false;
}

NearestPoint nearest_point(const SurfaceView& s, Positions x, const Vec3& query) noexcept {
  assert(!s.triangles.empty());
  Best best;
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) best.offer(s, x, t, query);
  return describe_nearest(s, x, best.point, query);
}

SurfacePoint slide(const SurfaceView& s, Positions x, const SurfacePoint& p, const Vec3& slip) noexcept {
  const Vec3 target = position_at(s, x, p) + slip;
  Best best;
  best.offer(s, x, p.triangle, target);
  constexpr int kRingsMax = 4;  // bounds the cost of a slip; the next slide covers the rest
  for (int ring = 0; ring < kRingsMax; ++ring) {
    const std::uint32_t from = best.point.triangle;
    best.offer_around(s, x, from, target);
    if (best.point.triangle == from) break;
  }
  return best.point;
}

Vec3 beyond_border(const SurfaceView& s, Positions x, const SurfacePoint& p, const Vec3& target) noexcept {
  if (!on_open_edge(s, p)) return Vec3::Zero();
  const Vec3 away = target - position_at(s, x, p), normal = normal_at(s, x, p);
  return away - normal.dot(away) * normal;
}

}  // namespace palpate
