#include "client/device/replay_device.hpp"

namespace palpate {

ReplayDevice::ReplayDevice(Motion motion, AtEnd at_end) : motion_(std::move(motion)), at_end_(at_end) {
  caps_.name = "replay";
  caps_.renders_force = false;
}

DeviceReading ReplayDevice::read(Micros now) noexcept {
  const Micros t = clock_.elapsed(now);
  const bool moves = at_end_ == AtEnd::stays || t <= motion_.duration();
  return {motion_.position(t), moves ? DeviceState::ok : DeviceState::ended};
}

}  // namespace palpate
