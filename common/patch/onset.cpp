#include "common/patch/onset.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace palpate {
namespace {

constexpr double kRoundingM = 1e-6;  // between the moment in which a contact ends and the position that follows from it

/// Returns the point at which the path from `from` to `to` enters triangle t from its front, and the share of the path up to it.
/// Its rim counts (Moeller and Trumbore, J. Graphics Tools 2 (1997)).
std::optional<std::pair<SurfacePoint, double>> crossing(const SurfaceView& s, Positions x, std::uint32_t t, const Vec3& from,
                                                        const Vec3& to) {
  constexpr double kRim = 1e-9;
  const Triangle& corners = s.triangles[t];
  const Vec3 a = vertex(x, corners[0]), ab = vertex(x, corners[1]) - a, ac = vertex(x, corners[2]) - a, way = to - from;
  const Vec3 across = way.cross(ac);
  const double volume = ab.dot(across);
  if (!(volume > 0)) return std::nullopt;  // along the triangle, or from its back
  const Vec3 begin = from - a, beside = begin.cross(ab);
  const double v = begin.dot(across) / volume, w = way.dot(beside) / volume, part = ac.dot(beside) / volume;
  if (!(v >= -kRim && w >= -kRim && v + w <= 1 + kRim && part >= 0 && part <= 1)) return std::nullopt;
  const Vec3 weight = Vec3(1 - v - w, v, w).cwiseMax(0.0);
  return std::pair{SurfacePoint{t, weight / weight.sum()}, part};
}

std::optional<SurfacePoint> first_crossing(const SurfaceView& s, Positions x, const Vec3& from, const Vec3& to) {
  std::optional<std::pair<SurfacePoint, double>> first;
  const Vec3 low = from.cwiseMin(to), high = from.cwiseMax(to);
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
    const Triangle& corners = s.triangles[t];
    const Vec3 a = vertex(x, corners[0]), b = vertex(x, corners[1]), c = vertex(x, corners[2]);
    if ((a.cwiseMin(b).cwiseMin(c).array() > high.array()).any() || (a.cwiseMax(b).cwiseMax(c).array() < low.array()).any())
      continue;
    const auto here = crossing(s, x, t, from, to);
    if (here && (!first || here->second < first->second)) first = here;
  }
  return first ? std::optional(first->first) : std::nullopt;
}

/// The tool relative to the surface that it was outside of at the last check.
struct Followed {
  Vec3 from = Vec3::Zero();                        ///< last position, moved along with the surface
  Vec3 before = Vec3::Zero();                      ///< normal there
  SurfacePoint point;                              ///< nearest point now, on the same sheet
  Vec3 gap = Vec3::Zero(), normal = Vec3::Zero();  ///< gap from there to the tool; normal there
};

std::optional<Followed> follow(const SurfaceView& s, Positions x, const Vec3& tool, const Clearance& clearance) {
  if (!clearance.known) return std::nullopt;
  const Vec3 at = position_at(s, x, clearance.point);
  Followed f{at + clearance.gap, normal_at(s, x, clearance.point), slide(s, x, clearance.point, tool - at)};
  if (!((tool - f.from).norm() <= kFollowedM)) return std::nullopt;
  f.gap = tool - position_at(s, x, f.point);
  f.normal = normal_at(s, x, f.point);
  return f;
}

/// Returns true between the sheets of a body that is inside out, in front of both, or on one of them.
bool is_inside_out(const SurfaceView& s, Positions x, const Vec3& at) {
  constexpr double kLeast = 0.25;  // 1 between them, one half on a sheet
  return winding_number(s, x, at) < -kLeast;
}

/// Returns the point at which the tool has come through the surface.
std::optional<SurfacePoint> entered_at(const SurfaceView& s, Positions x, const Vec3& tool, const Clearance& clearance,
                                       const Followed& f) {
  if ((tool - f.from).norm() + kRoundingM < clearance.gap.norm()) return std::nullopt;
  const Vec3 front = f.from + kRoundingM * f.before;
  const auto crossed = first_crossing(s, x, front, tool);
  if (!crossed) return std::nullopt;
  const SurfacePoint nearest = slide(s, x, *crossed, tool - position_at(s, x, *crossed));
  const Vec3 normal = normal_at(s, x, nearest);
  if (!((tool - position_at(s, x, nearest)).dot(normal) < 0) || on_open_edge(s, nearest)) return std::nullopt;
  const bool is_other_sheet = normal.dot(f.before) < 0;
  return is_other_sheet && is_inside_out(s, x, front) ? std::nullopt : std::optional(nearest);
}

/// Returns the clearance from the nearest point, unless another sheet of a body that is inside out has come between.
Clearance clearance_now(const SurfaceView& s, Positions x, const Vec3& tool, const NearestPoint& nearest,
                        const std::optional<Followed>& f) {
  const Clearance of_nearest = clearance_of(nearest.point, tool - nearest.position, nearest.normal);
  if (!f || f->gap.dot(f->normal) < 0 || nearest.normal.dot(f->normal) > 0) return of_nearest;
  return of_nearest.known && !is_inside_out(s, x, tool) ? of_nearest : Clearance{true, f->point, f->gap};
}

/// Returns the Phong projection of a sphere's centre near `from`, the point at which the interpolated normal passes through it:
/// there the sphere rests without friction. Returns `from` where none is found.
///
/// Each slide is a t(p), with t(p) the way from the normal at p to the centre; a follows from the last two slides, as by Barzilai
/// and Borwein, IMA J. Numer. Anal. 8 (1988), since t alone is too short where the surface is about as hollow as the sphere is
/// round. Source of the projection: Panozzo et al., Weighted averages on surfaces, ACM Trans. Graph. 32 (2013).
NearestPoint phong_projection(const SurfaceView& s, Positions x, const Vec3& centre, const NearestPoint& from) {
  constexpr int kSlides = 16;
  constexpr double kNearM = 5e-6, kLeastShare = 0.1, kMostShare = 8;
  NearestPoint at = from;
  Vec3 t_before = Vec3::Zero(), moved = Vec3::Zero();
  double share = 1;
  for (int slides = 0; slides < kSlides; ++slides) {
    const Vec3 away = centre - at.position;
    at.height_m = away.dot(at.normal);
    const Vec3 t = away - at.height_m * at.normal;
    if (t.norm() < kNearM) {
      at.at_border = on_open_edge(s, at.point);
      return at;
    }
    if (slides > 0) {
      const double nearer = moved.dot(t_before - t);
      share = nearer > 0 ? std::clamp(moved.squaredNorm() / nearer, kLeastShare, kMostShare) : kMostShare;
    }
    const Vec3 before = at.position;
    at.point = slide(s, x, at.point, share * t);
    at.position = position_at(s, x, at.point);
    at.normal = normal_at(s, x, at.point);
    moved = at.position - before;
    t_before = t;
  }
  return from;
}

}  // namespace

Clearance clearance_of(const SurfacePoint& point, const Vec3& gap, const Vec3& normal) noexcept {
  return {gap.dot(normal) > -kRoundingM, point, gap};
}

Onset look_for_contact(const SurfaceView& s, Positions x, const Vec3& tool, double radius_m, Clearance& clearance) noexcept {
  if (radius_m > 0) {
    NearestPoint nearest = nearest_point(s, x, tool);
    clearance = {};
    if (nearest.height_m < radius_m && !nearest.at_border) nearest = phong_projection(s, x, tool, nearest);
    return {nearest.height_m < radius_m, nearest};
  }
  const std::optional<Followed> followed = follow(s, x, tool, clearance);
  if (const auto entered = followed ? entered_at(s, x, tool, clearance, *followed) : std::nullopt) {
    clearance = {};
    NearestPoint here{*entered, position_at(s, x, *entered), normal_at(s, x, *entered), 0, false};
    here.height_m = -(tool - here.position).norm();
    return {true, here};
  }
  const NearestPoint nearest = nearest_point(s, x, tool);
  const bool inside = nearest.height_m < 0;
  clearance = inside || nearest.at_border ? Clearance{} : clearance_now(s, x, tool, nearest, followed);
  return {inside, nearest};
}

}  // namespace palpate
