#include "server/scene/distance_grid.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr int kFewestCells = 8;  // along each axis: a plate has a middle
constexpr int kMargin = 2;       // points around the box

}  // namespace

DistanceGrid::DistanceGrid(const Mat3& rotation, const Vec3& origin, const Vec3& low, const Vec3& high, double most_points,
                           const std::function<double(const Vec3&)>& distance)
    : inverse_(rotation.transpose()) {
  const Vec3 size = (high - low).cwiseMax(1e-6);
  const double cell = std::cbrt(size.prod() / most_points);
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = std::max(kFewestCells, static_cast<int>(std::ceil(size[axis] / cell)));
    spacing_[axis] = size[axis] / cells;
    points_[static_cast<std::size_t>(axis)] = cells + 1 + 2 * kMargin;
  }
  const Vec3 corner = low - kMargin * spacing_;
  first_ = inverse_ * origin + corner;
  values_.reserve(static_cast<std::size_t>(points_[0]) * static_cast<std::size_t>(points_[1]) *
                  static_cast<std::size_t>(points_[2]));
  for (int k = 0; k < points_[2]; ++k)
    for (int j = 0; j < points_[1]; ++j)
      for (int i = 0; i < points_[0]; ++i)
        values_.push_back(static_cast<float>(distance(origin + rotation * (corner + spacing_.cwiseProduct(Vec3(i, j, k))))));
}

std::optional<DistanceGrid::At> DistanceGrid::at(const Vec3& p) const noexcept {
  const Vec3 u = (inverse_ * p - first_).cwiseQuotient(spacing_);
  std::array<int, 3> begin{};
  std::array<std::array<double, 3>, 3> w{}, slope{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = u[static_cast<Eigen::Index>(axis)];
    if (!(at > 0.5 && at < points_[axis] - 1.5)) return std::nullopt;
    const double middle = std::floor(at + 0.5), t = at - middle, per_m = 1 / spacing_[static_cast<Eigen::Index>(axis)];
    begin[axis] = static_cast<int>(middle) - 1;
    w[axis] = {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
    slope[axis] = {per_m * (t - 0.5), -2 * per_m * t, per_m * (0.5 + t)};
  }
  At sum;
  const auto row = static_cast<std::size_t>(points_[0]), layer = row * static_cast<std::size_t>(points_[1]);
  const float* const corner = values_.data() + static_cast<std::size_t>(begin[2]) * layer +
                              static_cast<std::size_t>(begin[1]) * row + static_cast<std::size_t>(begin[0]);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < 3; ++j) {
      const float* const x = corner + k * layer + j * row;
      double value = 0, along = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        value += w[0][i] * static_cast<double>(x[i]);
        along += slope[0][i] * static_cast<double>(x[i]);
      }
      sum.distance_m += w[2][k] * w[1][j] * value;
      sum.gradient += Vec3(w[2][k] * w[1][j] * along, w[2][k] * slope[1][j] * value, slope[2][k] * w[1][j] * value);
    }
  sum.gradient = inverse_.transpose() * sum.gradient;
  return sum;
}

}  // namespace palpate
