#include "common/motion/motion.hpp"

#include <algorithm>
#include <cmath>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {

namespace {

void check_points(const std::vector<MotionPoint>& points, const std::string& name) {
  if (points.size() < 2) throw InputError(name, std::to_string(points.size()) + " points", "at least 2");
  double before = -1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MotionPoint& point = points[i];
    const auto where = [&] { return name + ": point " + std::to_string(i); };
    if (!(point.t_s >= 0 && point.t_s <= kMaxMotionS)) throw InputError(where(), "bad time", "0 to 8000 s");
    if (point.t_s <= before) throw InputError(where(), "time does not grow", "ascending times");
    if (!(point.position.cwiseAbs().maxCoeff() <= kWorldExtentM) || !point.position.allFinite())
      throw InputError(where(), "position out of range", "coordinates within 10 m of the origin");
    before = point.t_s;
  }
}

}  // namespace

Motion::Motion(std::vector<MotionPoint> points, const std::string& name) : points_(std::move(points)) {
  check_points(points_, name);
}

Motion Motion::rest(const Vec3& position, double duration_s) { return Motion({{0.0, position}, {duration_s, position}}); }

Vec3 Motion::position(double t_s) const noexcept {
  if (!(t_s > points_.front().t_s)) return points_.front().position;
  if (t_s >= points_.back().t_s) return points_.back().position;
  const auto after =
      std::upper_bound(points_.begin(), points_.end(), t_s, [](double t, const MotionPoint& point) { return t < point.t_s; });
  const MotionPoint& a = *(after - 1);
  const MotionPoint& b = *after;
  return a.position + (b.position - a.position) * ((t_s - a.t_s) / (b.t_s - a.t_s));
}

}  // namespace palpate
