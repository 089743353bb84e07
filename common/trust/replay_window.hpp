// Received counters of one direction, among the newest kReplayWindow (the sliding window of RFC 4303, section 3.4.3).
//
// A counter is checked before its datagram is decrypted (cheap, and reveals nothing about keys) and marked after its tag was
// verified: only a sender with the key can move the window.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>

namespace palpate {

inline constexpr std::size_t kReplayWindow = 2048;

class ReplayWindow {
 public:
  /// True when it is not older than the window and was not seen.
  bool is_fresh(std::uint64_t counter) const {
    if (counter >= next_) return true;
    return next_ - counter <= kReplayWindow && !seen_[counter % kReplayWindow];
  }
  /// Marks the counter of a datagram with a valid tag. Returns true when it is the newest.
  bool mark(std::uint64_t counter) {
    const bool newest = counter >= next_;
    if (newest) {
      const std::uint64_t skipped = std::min<std::uint64_t>(counter - next_, kReplayWindow);
      for (std::uint64_t k = 0; k < skipped; ++k) seen_.reset((counter - 1 - k) % kReplayWindow);
      next_ = counter + 1;
    }
    seen_.set(counter % kReplayWindow);
    return newest;
  }

 private:
  std::uint64_t next_ = 0;  ///< one more than the newest
  std::bitset<kReplayWindow> seen_;
};

}  // namespace palpate
