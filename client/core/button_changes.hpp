// Changes of the tool's buttons, handed from the haptic thread to the network thread. No computation uses them; they are for
// viewers and recordings.
#pragma once

#include "common/base/spsc_ring.hpp"
#include "common/base/tool_pose.hpp"

namespace palpate {

class ButtonChanges {
 public:
  /// Haptic thread, once a tick.
  void say(Micros now, std::uint32_t buttons) noexcept {
    // While the ring is full, the change waits for a tick that finds room.
    if (buttons != buttons_ && changes_.push({now, buttons})) buttons_ = buttons;
  }
  /// Network thread: pops the oldest change; false when there is none.
  bool take(ButtonChange& change) noexcept { return changes_.pop(change); }

 private:
  static constexpr std::size_t kChanges = 64;
  SpscRing<ButtonChange, kChanges> changes_;
  std::uint32_t buttons_ = 0;
};

}  // namespace palpate
