// Limits the rate of an action, however often it is requested: a burst at first, then once in `every`.
//
//     tokens(t) = min(burst, tokens(t0) + (t - t0) / every)        each action uses one
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

class RateLimit {
 public:
  RateLimit(int burst, Micros every) : span_(burst * every), every_(every) {}

  bool allows(Micros now) const { return std::max(empty_at_, now - span_) + every_ <= now; }
  /// Returns true if no token is missing.
  bool is_full(Micros now) const { return empty_at_ <= now - span_; }
  /// Uses one token. Only when allowed.
  void take(Micros now) { empty_at_ = std::max(empty_at_, now - span_) + every_; }

 private:
  Micros span_, every_;
  Micros empty_at_{Micros::min() / 2};  ///< time at which there were no tokens, given those that arrived since
};

}  // namespace palpate
