// The newest samples of a tool, ascending in time, in a ring: the history of either end. `Sample` has a time t.
#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

template <class Sample>
class SampleHistory {
 public:
  /// Keeps the newest `most` samples. Allocates for all of them; add() does not allocate.
  explicit SampleHistory(std::size_t most) : most_(most) { ring_.reserve(most); }

  /// Appends a sample; drops the oldest when the history is full.
  void add(const Sample& sample) noexcept {
    if (count_ == most_) drop_oldest();
    const std::size_t place = (first_ + count_++) % most_;
    if (place < ring_.size())
      ring_[place] = sample;
    else
      ring_.push_back(sample);
  }
  bool empty() const noexcept { return count_ == 0; }
  std::size_t size() const noexcept { return count_; }
  /// Returns sample i, the oldest first.
  const Sample& operator[](std::size_t i) const noexcept {
    assert(i < count_);
    return ring_[(first_ + i) % most_];
  }
  const Sample& oldest() const noexcept { return (*this)[0]; }
  const Sample& newest() const noexcept { return (*this)[count_ - 1]; }
  /// Returns the index of the first sample later than `t`; size() if there is none.
  std::size_t first_after(Micros t) const noexcept {
    std::size_t low = 0, high = count_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if ((*this)[middle].t > t)
        high = middle;
      else
        low = middle + 1;
    }
    return low;
  }
  /// Drops the samples that are older than the newest one not later than `t`; the last `kept` samples stay.
  void forget_before(Micros t, std::size_t kept = 1) noexcept {
    while (count_ > kept && (*this)[1].t <= t) drop_oldest();
  }
  void drop_newest() noexcept {
    assert(!empty());
    --count_;
  }

 private:
  void drop_oldest() noexcept {
    first_ = (first_ + 1) % most_;
    --count_;
  }

  std::size_t most_, first_ = 0, count_ = 0;
  std::vector<Sample> ring_;
};

}  // namespace palpate
