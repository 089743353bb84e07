// Orientation and buttons of the tool, handed from the haptic thread to the network thread separately from the samples: the
// newest orientation, and every change of the buttons. No computation uses either; they are for viewers and recordings.
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
    // While the ring is full, the change waits for a tick that finds room.
    if (buttons != buttons_ && changes_.push({now, buttons})) buttons_ = buttons;
  }

  /// Network thread: returns the newest orientation if one arrived since the last call, else nullptr.
  const Orientation* take_orientation() noexcept { return orientation_.take(); }
  /// Network thread: pops the oldest change; false when there is none.
  bool take_change(ButtonChange& change) noexcept { return changes_.pop(change); }

 private:
  static constexpr std::size_t kChanges = 64;
  LatestSlot<Orientation> orientation_;
  SpscRing<ButtonChange, kChanges> changes_;
  std::uint32_t buttons_ = 0;
  bool had_orientation_ = false;
};

}  // namespace palpate
