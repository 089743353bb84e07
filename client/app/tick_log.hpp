// The ticks of a run, kept for its report.
#pragma once

#include <span>
#include <vector>

#include "client/io/recorder.hpp"

namespace palpate {

class TickLog {
 public:
  /// Reserves room for `ticks` ticks of `displays` displays.
  TickLog(std::size_t ticks, std::size_t displays) : ticks_max_(ticks), width_(displays) {
    ticks_.reserve(ticks);
    displays_.reserve(ticks * displays);
  }

  void add(const TickRecord& tick, std::span<const DisplayRecord> displays) {
    if (ticks_.size() == ticks_max_) return void(++missed_);
    ticks_.push_back(tick);
    displays_.insert(displays_.end(), displays.begin(), displays.end());
  }

  std::size_t size() const { return ticks_.size(); }
  std::size_t missed() const { return missed_; }
  /// Returns a tick, with its time since the start of the motion.
  const TickRecord& tick(std::size_t row) const { return ticks_[row]; }
  std::span<const DisplayRecord> row(std::size_t row) const { return {displays_.data() + row * width_, width_}; }

 private:
  std::size_t ticks_max_, width_, missed_ = 0;
  std::vector<TickRecord> ticks_;
  std::vector<DisplayRecord> displays_;
};

}  // namespace palpate
