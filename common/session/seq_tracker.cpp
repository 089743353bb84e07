#include "common/session/seq_tracker.hpp"

#include <algorithm>

namespace palpate {

bool SeqTracker::take(std::uint32_t seq) {
  const bool first = expected_ == 0;
  const auto step = first ? 1 : static_cast<std::int32_t>(seq - highest_);
  if (step <= 0) {
    if (!take_late(static_cast<std::uint32_t>(-static_cast<std::int64_t>(step)))) return false;
  } else {
    seen_ = step >= 64 ? 1 : (seen_ << step) | 1;
    highest_ = seq;
    expected_ += static_cast<std::uint64_t>(step);
  }
  ++counts_.received;
  counts_.lost = expected_ - std::min(expected_, counts_.received);
  return step > 0;
}

/// Returns false for a duplicate. A number older than the window counts as late.
bool SeqTracker::take_late(std::uint32_t age) {
  if (age < 64) {
    const auto bit = std::uint64_t{1} << age;
    if (seen_ & bit) {
      ++counts_.duplicates;
      return false;
    }
    seen_ |= bit;
  }
  ++counts_.late;
  return true;
}

}  // namespace palpate
