// How the tool is held and its buttons, handed from the haptic thread to the network thread beside the samples: the newest
// orientation, and every change of the buttons. Nothing is computed with either; they are for viewers and recordings.
#pragma once

#include "common/base/latest_slot.hpp"
#include "common/base/spsc_ring.hpp"
#include "common/base/tool_pose.hpp"

namespace palpate {

class ToolHold {
 public:
  /// Haptic thread, once a tick. An orientation that is not of unit length counts as none.
  void say(Micros now, const Orientation& orientation, std::uint32_t buttons) noexcept {
    const bool usable = orientation && is_unit(*orientation);
    if (usable || had_orientation_) {
      orientation_.back() = usable ? orientation : Orientation();
      orientation_.publish();
      had_orientation_ = usable;
    }
    // Where the ring is full the change is said with the next tick that finds room.
    if (buttons != buttons_ && changes_.push({now, buttons})) buttons_ = buttons;
  }

  /// Network thread: the newest orientation where one came since the last call, else nullptr.
  const Orientation* take_orientation() noexcept { return orientation_.take(); }
  /// Network thread: the oldest change not taken yet; false when there is none.
  bool take_change(ButtonChange& change) noexcept { return changes_.pop(change); }

 private:
  static constexpr std::size_t kChanges = 64;
  LatestSlot<Orientation> orientation_;
  SpscRing<ButtonChange, kChanges> changes_;
  std::uint32_t buttons_ = 0;
  bool had_orientation_ = false;
};

}  // namespace palpate
