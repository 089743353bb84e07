// Limits the log lines of each kind: kBurst at once, then one per kRefill (rate_limit.hpp); further lines are dropped.
//
// So a day has at most kBurst + 86,400 lines of a kind. The next line that passes carries the number of those dropped before it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/rate_limit.hpp"

namespace palpate {

class EventLimit {
 public:
  static constexpr int kBurst = 20;
  static constexpr Micros kRefill{1'000'000};

  /// Returns the number of lines of this kind dropped since the last that passed; empty if this one is dropped as well.
  std::optional<std::uint64_t> take(const std::string& kind, Micros now) {
    Lines& lines = lines_[kind];
    if (!lines.limit.allows(now)) {
      ++lines.left_out;
      return std::nullopt;
    }
    lines.limit.take(now);
    return std::exchange(lines.left_out, 0);
  }

 private:
  struct Lines {
    RateLimit limit{kBurst, kRefill};
    std::uint64_t left_out = 0;
  };
  std::map<std::string, Lines> lines_;
};

}  // namespace palpate
