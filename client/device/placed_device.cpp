#include "client/device/placed_device.hpp"

#include <algorithm>

namespace palpate {

PlacedDevice::PlacedDevice(std::unique_ptr<Device> device, const Vec3& home)
    : device_(std::move(device)), caps_(device_->caps()), home_(home) {
  if (const Eigen::AlignedBox3d& own = caps_.workspace; !own.isEmpty())
    caps_.workspace = Eigen::AlignedBox3d(Vec3(home_ - own.sizes()), Vec3(home_ + own.sizes()));
  wait_for_start();
}

DeviceReading PlacedDevice::read(Micros now) noexcept {
  DeviceReading reading = device_->read(now);
  if (!reading.ok()) {
    risen_ = 0;
    return reading;
  }
  if (!placed_ && clock_.started(now)) {
    start_ = reading.position;
    placed_ = true;
  }
  reading.position = placed_ ? Vec3(home_ + (reading.position - start_)) : home_;
  return reading;
}

void PlacedDevice::write(const Vec3& force) noexcept {
  if (placed_) risen_ = std::min(risen_ + 1, kRiseTicks);
  device_->write(force * (static_cast<double>(risen_) / kRiseTicks));
}

void PlacedDevice::resume() noexcept {
  risen_ = 0;
  device_->resume();
}

}  // namespace palpate
