// How many lines of each kind a log takes, whatever happens how often: kBurst at once, one each kRefill (rate_limit.hpp); what is
// more is left out.
//
// So a day has at most kBurst + 86,400 lines of a kind. The next line that is let through says how many were left out before it.
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

  /// How many of this kind were left out since the last that was not; nothing where this one is left out as well.
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
