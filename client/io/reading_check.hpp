// Whether the positions of a device that says it is well can be believed. For devices that render a force; the haptic thread.
//
//     jumped   it moved further in the tick than kJump times what its largest speed allows
//     outside  it is beyond its workspace by more than kMargin of the workspace's size
//     frozen   it has moved before, and now not by a bit for kFrozenTicks while it was pushed with more than kPushedN: a hand
//     that
//              holds a tool trembles by more than what an encoder resolves, so nobody is at the other end, or nothing is measured
#pragma once

#include <string_view>

#include "client/device/device.hpp"

namespace palpate {

enum class ReadingFault : std::uint8_t { none, jumped, outside, frozen };
/// In words, as a DeviceReason.
std::string_view describe(ReadingFault fault) noexcept;

class ReadingCheck {
 public:
  static constexpr double kJump = 2, kMargin = 0.1, kPushedN = 0.3;
  static constexpr int kFrozenTicks = 250;

  explicit ReadingCheck(const DeviceCaps& caps);
  /// `force_n`: what was written last. Ticks that did not run are taken for one.
  ReadingFault look(const Vec3& position, Micros t, double force_n) noexcept;
  /// The device was away: what comes next is its first reading.
  void restart() noexcept { seen_ = false; }

 private:
  bool felt_;
  double speed_max_m_s_;
  Eigen::AlignedBox3d reach_;
  bool seen_ = false, has_moved_ = false;
  int still_ticks_ = 0;
  Vec3 last_ = Vec3::Zero();
  Micros last_t_{};
};

}  // namespace palpate
