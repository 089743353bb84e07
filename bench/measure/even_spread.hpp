// Points that fill a cube of many dimensions evenly for any number of points: the additive recurrence with the generalised golden
// ratio g, g^(d+1) = g + 1:  u_k <- u_k + g^-k mod 1  (M. Roberts, "The unreasonable effectiveness of quasirandom sequences",
// 2018), started at a point drawn from the seed.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "common/base/random.hpp"

namespace palpate {

template <std::size_t kAxes>
class EvenSpread {
 public:
  explicit EvenSpread(std::uint64_t seed) {
    double g = 1;
    for (int i = 0; i < 100; ++i) g = std::pow(1 + g, 1.0 / (kAxes + 1));
    Random random(seed);
    for (std::size_t k = 0; k < kAxes; ++k) {
      at_[k] = random.uniform();
      step_[k] = std::pow(g, -static_cast<double>(k + 1));
    }
  }
  /// Returns the next point, with every coordinate in [0, 1).
  const std::array<double, kAxes>& next() {
    for (std::size_t k = 0; k < kAxes; ++k) at_[k] = std::fmod(at_[k] + step_[k], 1.0);
    return at_;
  }

 private:
  std::array<double, kAxes> at_{}, step_{};
};

/// Returns the element of `from` at a share in [0, 1).
template <class List>
const auto& pick(double share, const List& from) {
  return from[static_cast<std::size_t>(share * static_cast<double>(from.size()))];
}

}  // namespace palpate
