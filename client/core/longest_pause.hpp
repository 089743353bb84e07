// The longest pause between two datagrams, over the last kWindow to 2 kWindow.
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

class LongestPause {
 public:
  static constexpr Micros kWindow{10'000'000};

  /// Notes that a datagram arrived; `now` is monotonic.
  void take(Micros now) {
    if (now - begin_ >= kWindow) {
      before_ = now - begin_ < 2 * kWindow ? longest_ : Micros{};
      longest_ = Micros{};
      begin_ = now;
    }
    if (heard_ != Micros::min()) longest_ = std::max(longest_, now - heard_);
    heard_ = now;
  }
  /// Ends the current pause without counting it: no datagram is due until the next one.
  void interrupt() { heard_ = Micros::min(); }
  Micros longest() const { return std::max(longest_, before_); }
  void reset() { *this = LongestPause{}; }

 private:
  Micros heard_{Micros::min()}, begin_{}, longest_{}, before_{};
};

}  // namespace palpate
