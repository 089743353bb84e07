#include "bench/measure/surface_gesture.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "bench/measure/gestures.hpp"
#include "bench/measure/upper_side.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

constexpr double kAboveM = 0.020, kDeepestM = 0.010, kFarthestM = 0.015;
constexpr double kPartDepth = 0.6, kDownS = 0.4, kHeldS = 0.6, kStrokeAlongS = 2, kCircleS = 3, kTapsHz = 3, kGestureRestS = 0.3;
constexpr double kInsertedM = 0.030, kInsertS = 1.5;
constexpr int kTapCount = 3;

class GestureMaker {
 public:
  explicit GestureMaker(const Scene& at_rest)
      : scene_(as_it_hangs(at_rest)), touches_(at_rest.tool.contact == ContactKind::touch) {
    const Scene& scene = scene_;
    Vec3 low = scene.body.nodes.front(), high = low;
    for (const Vec3& x : scene.body.nodes) low = low.cwiseMin(x), high = high.cwiseMax(x);
    const Vec3 home = home_of(scene);
    place_ = touches_ ? place_below(scene.body, home) : home;
    const Vec3 into = into_body(scene);
    height_m_ = std::abs((place_ - low).dot(into));
    depth_m_ = std::min(kDeepestM, height_m_ / 8);
    aside_m_ = std::min(kFarthestM, 0.1 * (high - low).maxCoeff());
    rest(kGestureRestS);
  }

  void press() {
    down(depth_m_);
    hold(kHeldS, [&](double) { return at(0, 0, depth_m_); });
    up(depth_m_);
  }
  void stroke() {
    const double depth = kPartDepth * depth_m_;
    down(depth);
    hold(kStrokeAlongS, [&](double u) { return at(aside_m_ * std::sin(2 * std::numbers::pi * minimum_jerk(u)), 0, depth); });
    up(depth);
  }
  void circle() {
    const double depth = kPartDepth * depth_m_;
    down(depth);
    const auto aside = [&](double u) { return at(aside_m_ * minimum_jerk(u), 0, depth); };
    hold(kDownS, aside);
    hold(kCircleS, [&](double u) {
      const double angle = 2 * std::numbers::pi * minimum_jerk(u);
      return at(aside_m_ * std::cos(angle), aside_m_ * std::sin(angle), depth);
    });
    hold(kDownS, [&](double u) { return aside(1 - u); });
    up(depth);
  }
  void tap() {
    const double depth = kPartDepth * depth_m_;
    down(0);
    hold(kTapCount / kTapsHz, [&](double u) {
      const double s = std::sin(std::numbers::pi * kTapCount * u);
      return at(0, 0, depth * s * s);
    });
    up(0);
  }
  void insert() {
    const double depth = std::min(kInsertedM, height_m_ / 2);
    down(depth, kInsertS);
    hold(kHeldS, [&](double) { return at(0, 0, depth); });
    up(depth, kInsertS);
  }
  Motion finish(SurfaceGesture gesture) {
    rest(kGestureRestS);
    return Motion(std::move(points_), std::string(name_of(gesture)));
  }

 private:
  /// Position `depth` below the surface at rest, offset sideways from the place; a grasp moves its node.
  Vec3 at(double x, double y, double depth) const {
    Vec3 p = place_ + Vec3(x, scene_.body.planar ? 0 : y, 0);
    if (touches_)
      if (const auto top = height_above(scene_.body, p.x(), p.y())) p.z() = *top;
    return p + depth * into_body(scene_);
  }
  void hold(double length_s, const std::function<Vec3(double)>& path) {
    const int ticks = static_cast<int>(std::lround(1e3 * length_s));
    for (int i = 0; i < ticks; ++i)
      points_.push_back({1e-3 * static_cast<double>(points_.size()), path(static_cast<double>(i) / ticks)});
  }
  double above_m() const { return touches_ ? kAboveM : 0.0; }
  void down(double depth, double length_s = kDownS) {
    hold(length_s, [&](double u) { return at(0, 0, -above_m() + minimum_jerk(u) * (above_m() + depth)); });
  }
  void up(double depth, double length_s = kDownS) {
    hold(length_s, [&](double u) { return at(0, 0, depth - minimum_jerk(u) * (above_m() + depth)); });
  }
  void rest(double length_s) {
    hold(length_s, [&](double) { return at(0, 0, -above_m()); });
  }

  Scene scene_;
  bool touches_;
  Vec3 place_ = Vec3::Zero();
  double height_m_ = 0, depth_m_ = 0, aside_m_ = 0;
  std::vector<MotionPoint> points_;
};

}  // namespace

std::optional<SurfaceGesture> surface_gesture_from_name(std::string_view name) {
  const auto at = std::find(kSurfaceGestureNames.begin(), kSurfaceGestureNames.end(), name);
  if (at == kSurfaceGestureNames.end()) return std::nullopt;
  return static_cast<SurfaceGesture>(at - kSurfaceGestureNames.begin());
}

Motion surface_gesture(const Scene& scene, SurfaceGesture gesture) {
  GestureMaker make(scene);
  const bool all = gesture == SurfaceGesture::tour;
  if (all || gesture == SurfaceGesture::press) make.press();
  if (all || gesture == SurfaceGesture::stroke) make.stroke();
  if (all || gesture == SurfaceGesture::circle) make.circle();
  if (all || gesture == SurfaceGesture::tap) make.tap();
  if (gesture == SurfaceGesture::insert) make.insert();
  return make.finish(gesture);
}

}  // namespace palpate
