#include "client/device/replay_device.hpp"

namespace palpate {

ReplayDevice::ReplayDevice(Motion motion) : motion_(std::move(motion)) { caps_.name = "replay"; }

DeviceReading ReplayDevice::read(Micros now) noexcept {
  const Micros t = clock_.elapsed(now);
  return {motion_.position(t), t <= motion_.duration()};
}

}  // namespace palpate
