#include "bench/measure/examination.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "bench/measure/gestures.hpp"
#include "bench/measure/upper_side.hpp"
#include "common/base/error.hpp"
#include "common/base/random.hpp"

namespace palpate {
namespace {

constexpr double kDeepM = 0.010, kLightM = 0.006, kAsideM = 0.015;
constexpr double kInS = 0.3, kTapHz = 3, kSwingHz = 5, kSwingDamping = 0.2;
constexpr double kPressS = 1.2, kStrokeS = 1.8, kTapS = 1.0, kReleaseS = 1.2;

struct Offset {
  double depth_m = 0, aside_m = 0;
};

/// In within kInS, and up again from `until_s` on.
double in_and_out(double t, double until_s) { return minimum_jerk(t / kInS) - minimum_jerk((t - until_s) / kInS); }

double swing_back(double t) {
  const double omega = 2 * std::numbers::pi * kSwingHz, damped = omega * std::sqrt(1 - kSwingDamping * kSwingDamping);
  return std::exp(-kSwingDamping * omega * t) * (std::cos(damped * t) + kSwingDamping * omega / damped * std::sin(damped * t));
}

Offset offset(double t) {
  constexpr double kHeldS = 0.4, kAlongS = 1.0;
  if (t < kPressS) return {kDeepM * in_and_out(t, kInS + kHeldS)};
  if ((t -= kPressS) < kStrokeS) {
    const double along = std::clamp((t - kInS) / kAlongS, 0.0, 1.0);
    return {kLightM * in_and_out(t, kInS + kAlongS), kAsideM * 0.5 * (1 - std::cos(2 * std::numbers::pi * along))};
  }
  if ((t -= kStrokeS) < kTapS) return {kLightM * std::pow(std::sin(std::numbers::pi * kTapHz * t), 2)};
  constexpr double kLetGoS = 0.5;
  t -= kTapS;
  return {kDeepM * (t < kLetGoS ? minimum_jerk(t / kInS) : swing_back(t - kLetGoS))};
}

/// A straight part of the fast strokes: its end, and its duration.
struct Leg {
  Offset to;
  double within_s = 0;
};

std::vector<Leg> legs_of_strokes() {
  constexpr double kHalfM = 0.022, kAcrossS = 0.63, kToMiddleS = 0.35, kDownS = 0.5;
  constexpr int kStrokes = 3;
  std::vector<Leg> legs{{{kLightM, 0}, kDownS}, {{kLightM, kHalfM}, kToMiddleS}};
  for (int k = 0; k < kStrokes; ++k) {
    legs.push_back({{kLightM, -kHalfM}, kAcrossS});
    legs.push_back({{kLightM, kHalfM}, kAcrossS});
  }
  legs.push_back({{kLightM, 0}, kToMiddleS});
  legs.push_back({{}, kDownS});
  return legs;
}

/// Distances along a ray to the surface of the body at rest, ascending.
std::vector<double> hits(const LumpedBody& body, const Vec3& from, const Vec3& along) {
  std::vector<double> distances;
  const std::vector<Vec3> rest = vertices_at_rest(body);
  for (const Triangle& t : body.triangles) {
    const Vec3 a = rest[t[0]], u = rest[t[1]] - a, v = rest[t[2]] - a;
    const Vec3 across = along.cross(v);
    const double determinant = u.dot(across);
    if (std::abs(determinant) < 1e-15) continue;
    const Vec3 offset = from - a, turned = offset.cross(u);
    const double x = offset.dot(across) / determinant, y = along.dot(turned) / determinant;
    if (x >= 0 && y >= 0 && x + y <= 1) distances.push_back(v.dot(turned) / determinant);
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

/// A random point of the surface, uniform over its area, and the outward normal of its triangle.
class DrawnPoint {
 public:
  DrawnPoint(const LumpedBody& body, std::uint64_t seed) : body_(body), rest_(vertices_at_rest(body)), random_(seed) {
    for (const Triangle& t : body.triangles) area_.push_back((area_.empty() ? 0 : area_.back()) + 0.5 * doubled(t).norm());
  }
  void draw() {
    const double share = random_.uniform() * area_.back();
    const Triangle& t =
        body_.triangles[static_cast<std::size_t>(std::upper_bound(area_.begin(), area_.end() - 1, share) - area_.begin())];
    double x = random_.uniform(), y = random_.uniform();
    if (x + y > 1) x = 1 - x, y = 1 - y;
    const Vec3 a = rest_[t[0]];
    point = a + x * (rest_[t[1]] - a) + y * (rest_[t[2]] - a);
    normal = doubled(t).normalized();
  }
  Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();

 private:
  Vec3 doubled(const Triangle& t) const { return (rest_[t[1]] - rest_[t[0]]).cross(rest_[t[2]] - rest_[t[0]]); }
  const LumpedBody& body_;
  std::vector<Vec3> rest_;
  std::vector<double> area_;  // cumulative area of the triangles
  Random random_;
};

constexpr double kOwnM = 1e-6;  // hits closer than this are one

/// `distances`: along a ray through a point of the surface; the body begins there at `from_m`.
double scale_for(const std::vector<double>& distances, double from_m) {
  const auto out = std::upper_bound(distances.begin(), distances.end(), from_m + kOwnM);
  return out == distances.end() ? 1 : std::min(1.0, kDeepestShare * (*out - from_m) / kDeepM);
}

/// Empty if the place is near fixed nodes, or out of reach of a hand.
std::optional<ExaminedPlace> place_at(const Scene& scene, const Vec3& point, const Vec3& normal) {
  const LumpedBody& body = scene.body;
  for (std::size_t i = 0; i < body.nodes.size(); ++i)
    if (body.fixed[i] && (body.nodes[i] - point).norm() < std::max(scene.tool.radius_m, kDeepM)) return std::nullopt;
  const std::vector<double> distances = hits(body, point, -normal);
  if (std::ranges::any_of(distances, [](double d) { return d < -kOwnM && d > -kFreeWayM; })) return std::nullopt;
  const Vec3 along = std::abs(normal.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  ExaminedPlace place;
  place.into = -normal;
  place.aside = (along - along.dot(normal) * normal).normalized();
  place.scale = scale_for(distances, 0);
  place.start = point + kGapM * normal;
  return place;
}

}  // namespace

ExaminedPlace top_of(const Scene& scene) {
  ExaminedPlace place;
  place.into = into_body(scene);
  place.start = start_of(scene);
  const std::vector<double> distances = hits(as_it_hangs(scene).body, place.start, place.into);
  const auto entry = std::upper_bound(distances.begin(), distances.end(), 0);
  if (scene.tool.contact == ContactKind::touch && entry != distances.end()) place.scale = scale_for(distances, *entry);
  return place;
}

std::vector<ExaminedPlace> drawn_places(const Scene& scene, int count) {
  constexpr std::uint64_t kPlacesSeed = 20'261'128;
  constexpr int kTriesMost = 1000;  // per place
  if (scene.tool.contact != ContactKind::touch || scene.body.triangles.empty())
    throw InputError(scene.name, "has no surface that a tool touches", "a scene with \"contact\": \"touch\"");
  std::vector<ExaminedPlace> places;
  DrawnPoint drawn(scene.body, kPlacesSeed);
  for (int tries = 0; static_cast<int>(places.size()) < count; ++tries) {
    if (tries == kTriesMost * count)
      throw InputError(scene.name, fmt::format("has {} of {} places that a hand can reach", places.size(), count),
                       "more of the surface free and away from what is held");
    drawn.draw();
    if (const auto place = place_at(scene, drawn.point, drawn.normal)) places.push_back(*place);
  }
  return places;
}

namespace {

Vec3 tool_at(const Scene& scene, const ExaminedPlace& place, const Offset& offset) {
  const double deeper = scene.tool.contact == ContactKind::touch ? (place.scale * kDeepM + kGapM) / kDeepM : 1.0;
  return place.start + deeper * offset.depth_m * place.into + place.scale * offset.aside_m * place.aside;
}

}  // namespace

Motion examination(const Scene& scene, const ExaminedPlace& place) {
  std::vector<MotionPoint> points;
  const int ticks = static_cast<int>(std::lround(1e3 * (kPressS + kStrokeS + kTapS + kReleaseS)));
  for (int ms = 0; ms <= ticks; ++ms) points.push_back({ms * 1e-3, tool_at(scene, place, offset(ms * 1e-3))});
  return Motion(std::move(points), "examination");
}

Motion fast_strokes(const Scene& scene, const ExaminedPlace& place) {
  std::vector<MotionPoint> points{{0, place.start}};
  Offset from;
  double begin_s = 0;
  for (const Leg& leg : legs_of_strokes()) {
    const auto ticks = static_cast<int>(std::lround(1e3 * leg.within_s));
    for (int ms = 1; ms <= ticks; ++ms) {
      const double part = minimum_jerk(static_cast<double>(ms) / ticks);
      points.push_back({begin_s + ms * 1e-3,
                        tool_at(scene, place,
                                {std::lerp(from.depth_m, leg.to.depth_m, part), std::lerp(from.aside_m, leg.to.aside_m, part)})});
    }
    from = leg.to;
    begin_s += leg.within_s;
  }
  return Motion(std::move(points), "fast strokes");
}

}  // namespace palpate
