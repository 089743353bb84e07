#include "common/motion/motion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {

namespace {

void check_points(const std::vector<MotionPoint>& points, const std::string& name) {
  if (points.size() < 2)
    throw InputError(name, std::to_string(points.size()) + (points.size() == 1 ? " point" : " points"), "at least 2");
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

/// Returns the last row that is not later than t_s, which is not before the first.
std::size_t row_at(const std::vector<MotionPoint>& points, double t_s) noexcept {
  const auto after =
      std::upper_bound(points.begin(), points.end(), t_s, [](double t, const MotionPoint& point) { return t < point.t_s; });
  return static_cast<std::size_t>(after - points.begin()) - 1;
}

void check_holds(const MotionHolds& holds, std::size_t points, const std::string& name) {
  for (const std::size_t size : {holds.orientations.size(), holds.buttons.size(), holds.openings.size()})
    if (size != 0 && size != points)
      throw InputError(name, std::to_string(size) + " holds of " + std::to_string(points) + " points", "one a point, or none");
  for (std::size_t i = 0; i < holds.orientations.size(); ++i)
    if (!is_unit(holds.orientations[i]))
      throw InputError(name + ": point " + std::to_string(i), "the quaternion is not of unit length", "a length of 1");
  for (std::size_t i = 0; i < holds.openings.size(); ++i)
    if (!(holds.openings[i] >= 0 && holds.openings[i] <= 1))
      throw InputError(name + ": point " + std::to_string(i), "opening out of range", "0 to 1");
}

}  // namespace

Motion::Motion(std::vector<MotionPoint> points, MotionHolds holds, const std::string& name)
    : points_(std::move(points)), holds_(std::move(holds)) {
  check_points(points_, name);
  check_holds(holds_, points_.size(), name);
  for (Eigen::Quaterniond& q : holds_.orientations) q.normalize();
}

Motion Motion::rest(const Vec3& position, double duration_s) { return Motion({{0.0, position}, {duration_s, position}}); }

Orientation Motion::orientation(Micros t) const noexcept {
  const auto& turns = holds_.orientations;
  if (turns.empty()) return {};
  const double t_s = seconds(t);
  if (!(t_s > points_.front().t_s)) return turns.front();
  if (t_s >= points_.back().t_s) return turns.back();
  const std::size_t before = row_at(points_, t_s);
  const double from_s = points_[before].t_s, to_s = points_[before + 1].t_s;
  return turns[before].slerp((t_s - from_s) / (to_s - from_s), turns[before + 1]);
}

double Motion::opening(Micros t) const noexcept {
  const auto& openings = holds_.openings;
  if (openings.empty()) return 0;
  const double t_s = seconds(t);
  if (!(t_s > points_.front().t_s)) return openings.front();
  if (t_s >= points_.back().t_s) return openings.back();
  const std::size_t before = row_at(points_, t_s);
  const double from_s = points_[before].t_s, to_s = points_[before + 1].t_s;
  return std::lerp(openings[before], openings[before + 1], (t_s - from_s) / (to_s - from_s));
}

std::uint32_t Motion::buttons(Micros t) const noexcept {
  return holds_.buttons.empty() || seconds(t) < points_.front().t_s ? 0 : holds_.buttons[row_at(points_, seconds(t))];
}

int Motion::button_count() const noexcept {
  std::uint32_t ever = 0;
  for (const std::uint32_t pressed : holds_.buttons) ever |= pressed;
  return std::bit_width(ever);
}

Vec3 Motion::position(double t_s) const noexcept {
  if (!(t_s > points_.front().t_s)) return points_.front().position;
  if (t_s >= points_.back().t_s) return points_.back().position;
  const std::size_t before = row_at(points_, t_s);
  const MotionPoint &a = points_[before], &b = points_[before + 1];
  return a.position + (b.position - a.position) * ((t_s - a.t_s) / (b.t_s - a.t_s));
}

}  // namespace palpate
