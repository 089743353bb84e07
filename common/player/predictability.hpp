// Share of a hand's motion that its velocity predicts, measured on the hand's own past.
//
// At t the hand was expected a time h later at x + h v. The share is the factor s in [0, 1] that would have made the expectations
// of the last kMemoryS the best ones in the sense of least squares,
//
//     s = sum h v(t - h) . (x(t) - x(t - h)) / sum |h v(t - h)|^2,    v(t) = (3 x(t) - 4 x(t - d) + x(t - 2 d)) / (2 d)
//
// with d = 30 ms, and weights that fade by e each kMemoryS. For a sine of angular frequency w it tends to sin(w h) / (w h): a
// slow motion continues as expected, one that swings to and fro within h does not. 1 until the past is long enough. Least squares
// of a scalar gain: Kay, Fundamentals of Statistical Signal Processing (1993), 4 and 8.
//
// A hand that swings comes back to where it is on average, after h by 1 - cos(w h) of the way. By this share it is expected to:
//
//     back = max(0, 1 - 3 s / 2) (m - x),    m the mean of x, low-passed by kMeanS
//
// 1 - 3 s / 2 is 0 up to w h = 1.5, where a swing keeps its direction for most of h, and 1 at half a period.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/types.hpp"

namespace palpate {

class Predictability {
 public:
  static constexpr Micros kEvery{10'000};
  static constexpr double kMemoryS = 0.3, kMeanS = 0.3, kHorizonLeastS = 0.03, kHorizonMostS = 0.25;

  /// Adds the position of the hand, kEvery after the one before. `horizon_s` is h; it is clamped to its bounds.
  void add(const Vec3& position, double horizon_s) noexcept {
    newest_ = (newest_ + 1) % kKept;
    places_[newest_] = position;
    mean_ = known_ == 0 ? position : Vec3(mean_ + kEveryS / (kMeanS + kEveryS) * (position - mean_));
    known_ = std::min(known_ + 1, kKept);
    const auto h = static_cast<std::size_t>(std::lround(std::clamp(horizon_s, kHorizonLeastS, kHorizonMostS) / kEveryS));
    if (known_ <= h + 2 * kStep) return;
    const Vec3 expected =
        static_cast<double>(h) / (2.0 * kStep) * (3 * before(h) - 4 * before(h + kStep) + before(h + 2 * kStep));
    const double fade = std::exp(-kEveryS / kMemoryS);
    along_ = fade * along_ + expected.dot(position - before(h));
    square_ = fade * square_ + expected.squaredNorm();
  }
  /// s.
  double share() const noexcept { return square_ > 0 ? std::clamp(along_ / square_, 0.0, 1.0) : 1; }
  /// Displacement by which the hand, now at `position`, is expected to come back within h [m].
  Vec3 back(const Vec3& position) const noexcept { return std::max(0.0, 1 - 1.5 * share()) * (mean_ - position); }

 private:
  static constexpr double kEveryS = 0.01;
  static constexpr std::size_t kStep = 3, kKept = 32;  // the longest horizon and 2 kStep
  const Vec3& before(std::size_t ago) const { return places_[(newest_ + kKept - ago) % kKept]; }

  std::array<Vec3, kKept> places_;
  Vec3 mean_ = Vec3::Zero();
  std::size_t newest_ = 0, known_ = 0;
  double along_ = 0, square_ = 0;
};

}  // namespace palpate
