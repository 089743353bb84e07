// The choice of a HID device and its settings, as written behind "hid:":
//
//     [WHICH][,KEY=VALUE]...        for example  7      ,control=position      hidraw2,force-n=4,flip=y
//
// WHICH: a serial number, or the node (hidraw2, /dev/hidraw2); empty: the only device present.
//
//     six-axis mouse:  control=rate|position  axes=x-y-z  speed-m-s=0.15  reach-m=0.06
//     PID joystick:    force-n=4 (at full magnitude; has to be given)  reach-m=0.05  flip=x|y|xy
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "client/device/hid/force_joystick.hpp"
#include "client/device/hid/space_mouse.hpp"

namespace palpate {

class HidSettings {
 public:
  /// Throws InputError for anything but KEY=VALUE, and for a repeated key.
  explicit HidSettings(std::string_view text);

  const std::string& which() const { return which_; }
  /// Return the options of that kind of device. Throw InputError for a key that the kind does not have, or a value out of range.
  SpaceMouseOptions space_mouse() const;
  ForceJoystickOptions force_joystick() const;
  void force_profile() const;

 private:
  using Values = std::map<std::string, std::string>;
  std::string which_;
  Values values_;
};

}  // namespace palpate
