// Draws the paths of hands.
#include <algorithm>

#include "bench/world/draw.hpp"
#include "common/base/minimum_jerk.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

/// Place where the hand of station `index` works, and its range.
struct Playground {
  Vec3 home = Vec3::Zero(), reach = Vec3::Zero();  ///< reach: sideways, sideways, into the body
  double above_m = 0;                              ///< height between touches, 0 for a grasp
};

Playground playground(const Scenario& s, Random& random, std::size_t index, std::size_t count) {
  const LumpedBody& body = s.scene.body;
  double spacing_m = 1;
  Vec3 low = body.nodes[0], high = body.nodes[0];
  for (const Element& e : body.elements) spacing_m = std::min(spacing_m, e.rest_length_m);
  for (const Vec3& x : body.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  Playground p;
  p.home = home_of(s.scene);
  const double far = random.uniform(0.1, 0.45) * spacing_m;
  p.reach = Vec3(far, far, body.planar ? 0 : far);
  if (s.scene.tool.contact == ContactKind::attach) return p;
  const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low);
  const double side = count > 1 ? -0.45 + 0.9 * static_cast<double>(index) / static_cast<double>(count - 1) : 0;
  p.home = Vec3(middle.x() + side * half.x() + random.uniform(-0.15, 0.15) * half.x(),
                middle.y() + random.uniform(-0.25, 0.25) * half.y(), high.z());
  p.reach = Vec3(0.2 * half.x(), 0.3 * half.y(), random.uniform(0.1, 0.45) * spacing_m);
  p.above_m = random.uniform(0.002, 0.015);
  return p;
}

class PathDraw {
 public:
  PathDraw(const Vec3& start) : at_(start) { points_.push_back({0, start}); }

  /// Adds a reach along a minimum-jerk curve.
  void reach(const Vec3& to, double duration_s) {
    constexpr double kSampleS = 0.004;
    const int n = std::max(2, static_cast<int>(duration_s / kSampleS));
    for (int i = 1; i <= n; ++i) {
      const double c = static_cast<double>(i) / n;
      points_.push_back({t_s_ + c * duration_s, at_ + minimum_jerk(c) * (to - at_)});
    }
    t_s_ += duration_s;
    at_ = to;
  }
  void stay(double until_s) {
    if (until_s <= t_s_) return;
    points_.push_back({until_s, at_});
    t_s_ = until_s;
  }
  double now_s() const { return t_s_; }
  std::vector<MotionPoint> points() const { return points_; }

 private:
  Vec3 at_;
  double t_s_ = 0;
  std::vector<MotionPoint> points_;
};

}  // namespace

std::vector<MotionPoint> draw_path(const Scenario& s, std::size_t index, std::size_t count) {
  Random random = part_of(s.drawn_with.seed, Part::hand, 1000 + index);
  const Playground p = playground(s, random, index, count);
  const auto somewhere = [&](double height_m) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1);
    return Vec3(p.home + Vec3(x * p.reach.x(), y * p.reach.y(), height_m));
  };
  const double jabs = random.uniform(0, 0.3);
  PathDraw path(p.home + Vec3(0, 0, p.above_m));
  path.stay(random.uniform(0.2, 0.5));
  const double rest_s = seconds(s.rest);
  while (path.now_s() < rest_s - 0.35) {
    const bool lifted = random.chance(0.3), jab = random.chance(jabs);
    const double depth_m = random.uniform(-1, p.above_m > 0 ? -0.1 : 1) * p.reach.z();
    const double duration_s = jab ? random.uniform(0.05, 0.1) : random.uniform(0.15, 0.5);
    const Vec3 to = somewhere(lifted && p.above_m > 0 ? p.above_m : depth_m);
    path.reach(to, std::min(duration_s, rest_s - 0.3 - path.now_s() + 0.05));
  }
  path.reach(somewhere(-random.uniform(0.5, 1) * p.reach.z()), std::max(0.05, rest_s - path.now_s()));
  path.stay(rest_s + 60);
  return path.points();
}

}  // namespace palpate
