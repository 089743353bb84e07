// Time to wait for a station's samples: an age that its newest sample rarely exceeds before the next one comes.
//
// It tracks the 98 % quantile of that age: up by kUp when the age exceeds it, down by kDown otherwise (0.1 of 5 ms; in balance 2
// % of the datagrams exceed it). When the path becomes shorter, perhaps by hundreds of milliseconds, the buffer follows at once:
// it is never longer than the largest age of the last two periods.
#pragma once

#include <algorithm>
#include <utility>

#include "common/base/types.hpp"

namespace palpate {

class JitterBuffer {
 public:
  static constexpr Micros kUp{4'900}, kDown{100}, kPeriod{500'000};

  /// Starts with the first samples, which came at this age.
  void begin(Micros age, Micros now) {
    *this = {};
    length_ = age;
    began_ = now;
  }
  /// Adds newer samples; `age` is that of the newest one before them.
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
  Micros oldest_{}, oldest_before_ = Micros::max();  // largest age in this period, and in the one before
};

}  // namespace palpate
