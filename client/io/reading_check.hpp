// Checks the positions of a device that reports no fault. For devices that render a force; haptic thread.
//
//     jumped   it moved further in the tick than kJump times its largest speed allows, or of a device that renders a torque, it
//              turned further than kJump times its largest rate of rotation allows
//     outside  it is beyond its workspace by more than kMargin of the workspace's size
//     frozen   it has moved before, but is bit-identical for kFrozenTicks while pushed with more than kPushedN: a hand that holds
//              a tool trembles by more than the encoder's resolution, so nobody holds it, or nothing is measured
#pragma once

#include <string_view>

#include "client/device/device.hpp"
#include "common/base/tool_shape.hpp"

namespace palpate {

enum class ReadingFault : std::uint8_t { none, jumped, outside, frozen };
/// Describes the fault in words, as a DeviceReason.
std::string_view describe(ReadingFault fault) noexcept;

class ReadingCheck {
 public:
  static constexpr double kJump = 2, kMargin = 0.1, kPushedN = 0.3;
  static constexpr int kFrozenTicks = 250;

  explicit ReadingCheck(const DeviceCaps& caps);
  /// Checks a pose. `force_n`: the force written last. Skipped ticks count as one.
  ReadingFault look(const ToolPose& pose, Micros t, double force_n) noexcept;
  /// Restarts after the device was away: the next reading is its first one.
  void restart() noexcept { seen_ = false; }

 private:
  bool felt_;
  double speed_max_m_s_, spin_max_rad_s_;  ///< the latter 0: rotations are not checked
  Eigen::AlignedBox3d reach_;
  bool seen_ = false, has_moved_ = false;
  int still_ticks_ = 0;
  ToolPose last_;
  Micros last_t_{};
};

}  // namespace palpate
