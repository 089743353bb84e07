#include "client/device/replay_device.hpp"

namespace palpate {

ReplayDevice::ReplayDevice(Motion motion, AtEnd at_end) : motion_(std::move(motion)), at_end_(at_end) { caps_.name = "replay"; }

DeviceReading ReplayDevice::read(Micros now) noexcept {
  const Micros t = clock_.elapsed(now);
  return {motion_.position(t), at_end_ == AtEnd::stays || t <= motion_.duration()};
}

}  // namespace palpate
