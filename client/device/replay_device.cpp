#include "client/device/replay_device.hpp"

namespace palpate {

ReplayDevice::ReplayDevice(Motion motion, AtEnd at_end) : motion_(std::move(motion)), at_end_(at_end) {
  caps_.name = "replay";
  caps_.renders_force = false;
  caps_.has_orientation = motion_.has_orientation();
  caps_.buttons = motion_.button_count();
  caps_.has_opening = motion_.has_opening();
}

DeviceReading ReplayDevice::read(Micros now) noexcept {
  const Micros t = clock_.elapsed(now);
  const bool moves = at_end_ == AtEnd::stays || t <= motion_.duration();
  DeviceReading reading{motion_.position(t), moves ? DeviceState::ok : DeviceState::ended,
                        motion_.orientation(t).value_or(Eigen::Quaterniond::Identity()), motion_.buttons(t)};
  reading.opening = motion_.opening(t);
  return reading;
}

}  // namespace palpate
