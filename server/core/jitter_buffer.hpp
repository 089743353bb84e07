// How long the samples of a station are waited for: what the age of its newest sample rarely exceeds before the next comes.
//
// A tracker of that age's 98 % quantile: up by kUp where it is exceeded, down by kDown where not (0.1 of 5 ms: in balance 2 % of
// the datagrams exceed it). A way that became shorter, by hundreds of milliseconds perhaps, must not be waited for any more: the
// buffer is no longer than the oldest of the last two periods.
#pragma once

#include <algorithm>
#include <utility>

#include "common/base/types.hpp"

namespace palpate {

class JitterBuffer {
 public:
  static constexpr Micros kUp{4'900}, kDown{100}, kPeriod{500'000};

  /// The first samples came, so old.
  void begin(Micros age, Micros now) {
    *this = {};
    length_ = age;
    began_ = now;
  }
  /// Newer samples came; the newest before them was of this age.
  void take(Micros age, Micros now) {
    length_ += age > length_ ? kUp : -kDown;
    oldest_ = std::max(oldest_, age);
    if (now - began_ < kPeriod) return;
    length_ = std::min(length_, std::max(oldest_, oldest_before_));
    oldest_before_ = std::exchange(oldest_, Micros{});
    began_ = now;
  }
  Micros length() const { return length_; }

 private:
  Micros length_{}, began_{};
  Micros oldest_{}, oldest_before_ = Micros::max();  // of this period, of the one before
};

}  // namespace palpate
