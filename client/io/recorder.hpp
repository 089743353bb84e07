// Passes the felt forces of every tick from the haptic thread to a reader: one main display and any number of comparison
// displays. A wait-free ring of rows in memory allocated at the start; one writer, one reader.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <span>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/wrench.hpp"

namespace palpate {

struct DisplayRecord {
  Wrench wrench;  ///< on the tool
  bool contact = false;
};

struct TickRecord {
  Micros t{};  ///< client's clock
  Vec3 position = Vec3::Zero();
  Wrench model;  ///< of the main display before its guard
  Micros patch_age{};
  bool has_patch = false;
  bool swapped = false;  ///< true: a new patch took over, with the step `step_n` before the cross-fade
  double step_n = 0;
  Orientation orientation = {};
  std::uint32_t buttons = 0;
  double opening = 0, grip = 0;  ///< of jaws (tool_shape.hpp)
};

class Recorder {
 public:
  /// Allocates room for `ticks` ticks of `displays` displays, and touches it so that no page fault follows later.
  Recorder(std::size_t ticks, std::size_t displays) : ticks_(ticks), displays_(ticks * displays), width_(displays) {}

  // functions of the haptic thread
  /// Starts a row; false (and counted) when the reader is behind by the whole ring. Always false without room: there is no
  /// reader.
  bool begin(const TickRecord& tick) noexcept {
    if (ticks_.empty()) return false;
    if (begun_ - taken_.load(std::memory_order_acquire) == ticks_.size()) {
      missed_.store(missed_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    ticks_[begun_ % ticks_.size()] = tick;
    return true;
  }
  /// Sets display `index` of the row begun last.
  void set(std::size_t index, const DisplayRecord& record) noexcept {
    displays_[begun_ % ticks_.size() * width_ + index] = record;
  }
  /// Publishes the row.
  void end() noexcept { written_.store(++begun_, std::memory_order_release); }

  // functions of the reader
  /// Pops the oldest row; false when there is none. `displays` has room for all of them.
  bool take(TickRecord& tick, std::span<DisplayRecord> displays) {
    const std::size_t at = taken_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    const std::size_t row = at % ticks_.size();
    tick = ticks_[row];
    std::copy_n(displays_.begin() + static_cast<std::ptrdiff_t>(row * width_), width_, displays.begin());
    taken_.store(at + 1, std::memory_order_release);
    return true;
  }

  std::size_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }

 private:
  std::vector<TickRecord> ticks_;
  std::vector<DisplayRecord> displays_;
  std::size_t width_;
  std::size_t begun_ = 0;
  alignas(64) std::atomic<std::size_t> written_{0};
  alignas(64) std::atomic<std::size_t> taken_{0};
  alignas(64) std::atomic<std::size_t> missed_{0};
};

}  // namespace palpate
