// The moment at which the hands of one program begin to move: the same for all, once each of them is felt or has ended.
//
// Thread-safe; polled, so that a hand continues to serve its device while it waits for the others.
#pragma once

#include <algorithm>
#include <mutex>

#include "common/base/types.hpp"

namespace palpate {

class CommonStart {
 public:
  explicit CommonStart(std::size_t hands) : missing_(hands) {}

  /// Reports that a hand is ready, or that it ended before it was. Once for each.
  void arrive() {
    const std::scoped_lock lock(mutex_);
    missing_ -= std::min<std::size_t>(missing_, 1);
  }
  bool all_are_here() const {
    const std::scoped_lock lock(mutex_);
    return missing_ == 0;
  }
  /// Returns the common moment: the first one that is proposed.
  Micros agree(Micros proposed) {
    const std::scoped_lock lock(mutex_);
    if (start_ == Micros::max()) start_ = proposed;
    return start_;
  }

 private:
  mutable std::mutex mutex_;
  std::size_t missing_;
  Micros start_ = Micros::max();  ///< none yet
};

}  // namespace palpate
