// How often something may be done, whoever asks for it how often: so many times at once, then once in `every`.
//
//     tokens(t) = min(burst, tokens(t0) + (t - t0) / every)        each time takes one
#pragma once

#include <algorithm>

#include "common/base/types.hpp"

namespace palpate {

class RateLimit {
 public:
  RateLimit(int burst, Micros every) : span_(burst * every), every_(every) {}

  bool allows(Micros now) const { return std::max(empty_at_, now - span_) + every_ <= now; }
  /// Once, where it is allowed.
  void take(Micros now) { empty_at_ = std::max(empty_at_, now - span_) + every_; }

 private:
  Micros span_, every_;
  Micros empty_at_{Micros::min() / 2};  ///< when tokens that come since then were none
};

}  // namespace palpate
