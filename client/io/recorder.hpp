// Keeps what the hand felt in every tick, in memory taken at the start: one main display and any number of comparison displays.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

struct DisplayRecord {
  Vec3 force = Vec3::Zero();  ///< on the tool [N]
  bool contact = false;
};

struct TickRecord {
  Micros t{};  ///< since the start of the motion
  Vec3 position = Vec3::Zero();
  Micros patch_age{};
  bool has_patch = false;
};

class Recorder {
 public:
  /// Room for `ticks` ticks of `displays` displays, touched now so that no page is fetched later.
  Recorder(std::size_t ticks, std::size_t displays) : ticks_(ticks), displays_(ticks * displays), width_(displays) {}

  /// Starts a row; false (and counted) when there is no room.
  bool begin(const TickRecord& tick) noexcept {
    if (size_ == ticks_.size()) return ++missed_, false;
    ticks_[size_++] = tick;
    return true;
  }
  /// Display `index` of the row begun last.
  void set(std::size_t index, const DisplayRecord& record) noexcept { displays_[(size_ - 1) * width_ + index] = record; }

  std::size_t size() const noexcept { return size_; }
  std::size_t missed() const noexcept { return missed_; }
  std::size_t displays() const noexcept { return width_; }
  const TickRecord& tick(std::size_t row) const { return ticks_[row]; }
  std::span<const DisplayRecord> row(std::size_t row) const { return {displays_.data() + row * width_, width_}; }

 private:
  std::vector<TickRecord> ticks_;
  std::vector<DisplayRecord> displays_;
  std::size_t width_, size_ = 0, missed_ = 0;
};

}  // namespace palpate
