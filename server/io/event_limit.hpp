// How many lines of each kind a log takes, whatever happens how often: a token bucket a kind.
//
//     tokens(t) = min(kBurst, tokens(t0) + (t - t0) / kRefill)        a line takes one; where there is none it is left out
//
// So a day has at most kBurst + 86,400 lines of a kind. The next line that is let through says how many were left out before it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/types.hpp"

namespace palpate {

class EventLimit {
 public:
  static constexpr int kBurst = 20;
  static constexpr Micros kRefill{1'000'000};

  /// How many of this kind were left out since the last that was not; nothing where this one is left out as well.
  std::optional<std::uint64_t> take(const std::string& kind, Micros now) {
    Bucket& bucket = buckets_.try_emplace(kind, Bucket{now - kBurst * kRefill, 0}).first->second;
    bucket.empty_at = std::max(bucket.empty_at, now - kBurst * kRefill);
    if (bucket.empty_at + kRefill > now) {
      ++bucket.left_out;
      return std::nullopt;
    }
    bucket.empty_at += kRefill;
    return std::exchange(bucket.left_out, 0);
  }

 private:
  struct Bucket {
    Micros empty_at{};  ///< when a bucket that fills since then was empty: tokens = (now - empty_at) / kRefill
    std::uint64_t left_out = 0;
  };
  std::map<std::string, Bucket> buckets_;
};

}  // namespace palpate
