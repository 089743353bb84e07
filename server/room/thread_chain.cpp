#include "server/room/thread_chain.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {

ThreadChain::ThreadChain(const Vec3& bite, const Vec3& direction, double length_m)
    : ThreadChain(bite, bite + length_m * direction, std::max(1, static_cast<int>(std::lround(length_m / kSpacingM)))) {}

ThreadChain::ThreadChain(const Vec3& bite, const Vec3& end, int segments)
    : x_(static_cast<std::size_t>(segments) + 1), v_(x_.size()) {
  lay(bite, end);
}

void ThreadChain::lay(const Vec3& bite, const Vec3& end) {
  const std::size_t last = x_.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) x_[i] = bite + static_cast<double>(i) / static_cast<double>(last) * (end - bite);
  std::ranges::fill(v_, Vec3::Zero());
}

void ThreadChain::lay(std::span<const Vec3> places) {
  assert(places.size() == x_.size());
  std::ranges::copy(places, x_.begin());
  std::ranges::fill(v_, Vec3::Zero());
}

void ThreadChain::advance(double over_s, const Vec3& bite, const std::optional<Vec3>& hand, double length_m,
                          const Vec3& gravity_m_s2) {
  constexpr int kMostSteps = 40;
  const std::size_t last = x_.size() - 1;
  const double segment_m = length_m / static_cast<double>(last);
  const int steps = std::clamp(static_cast<int>(std::ceil(over_s / kStepS)), 1, kMostSteps);
  const double h = std::min(over_s, kMostSteps * kStepS) / steps;
  if (!(h > 0)) return;
  const Vec3 bite_before = x_.front(), hand_before = x_.back();
  for (int step = 1; step <= steps; ++step) {
    const std::vector<Vec3> before = x_;
    const double part = static_cast<double>(step) / steps;
    for (std::size_t i = 1; i <= last; ++i) {
      v_[i] = std::exp(-h / kDragS) * (v_[i] + h * gravity_m_s2);
      x_[i] += h * v_[i];
    }
    x_.front() = bite_before + part * (bite - bite_before);
    if (hand) x_.back() = hand_before + part * (*hand - hand_before);
    keep_lengths(hand.has_value(), segment_m);
    for (std::size_t i = 0; i <= last; ++i) v_[i] = (x_[i] - before[i]) / h;
  }
}

/// Newton's method: J J^T y = C - s, x -= J^T y, C the lengths and J their derivatives; held ends do not move.
void ThreadChain::keep_lengths(bool held, double segment_m) {
  constexpr int kIterations = 50;
  const std::size_t segments = x_.size() - 1;
  const Vec3 way = x_.back() - x_.front();
  if (held && way.norm() >= (1 - kTolerance) * segment_m * static_cast<double>(segments)) {
    const Vec3 from = x_.front();
    for (std::size_t i = 1; i < segments; ++i) x_[i] = from + static_cast<double>(i) / static_cast<double>(segments) * way;
    return;
  }
  below_.resize(segments);
  pivots_.resize(segments);
  rest_.resize(segments);
  std::vector<Vec3> u(segments);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double most = 0;
    for (std::size_t i = 0; i < segments; ++i) {
      u[i] = x_[i + 1] - x_[i];
      const double length = u[i].norm();
      rest_[i] = length - segment_m;
      u[i] = length > 0 ? Vec3(u[i] / length) : Vec3::UnitZ();
      most = std::max(most, std::abs(rest_[i]));
    }
    if (most <= kTolerance * segment_m) return;
    // Thomas' algorithm; the matrix is symmetric, and with a little on its diagonal definite where the chain is straight.
    constexpr double kRegular = 1e-6;
    double pivot = 0;
    for (std::size_t i = 0; i < segments; ++i) {
      const double ends = (i == 0 ? 0.0 : 1.0) + (held && i + 1 == segments ? 0.0 : 1.0);
      const double beside = i == 0 ? 0 : -u[i - 1].dot(u[i]);
      below_[i] = i == 0 ? 0 : beside / pivot;
      pivot = ends + kRegular - below_[i] * beside;
      rest_[i] -= i == 0 ? 0 : below_[i] * rest_[i - 1];
      pivots_[i] = pivot;
    }
    for (std::size_t i = segments; i-- > 0;) {
      const double above = i + 1 == segments ? 0 : -u[i].dot(u[i + 1]) * rest_[i + 1];
      rest_[i] = (rest_[i] - above) / pivots_[i];
    }
    for (std::size_t i = 0; i < segments; ++i) {
      if (i > 0) x_[i] += rest_[i] * u[i];
      if (!held || i + 1 < segments) x_[i + 1] -= rest_[i] * u[i];
    }
  }
}

}  // namespace palpate
