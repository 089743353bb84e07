#include "client/device/mouse_device.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

MouseDevice::MouseDevice(const Vec3& at) : target_(at), position_(at) {
  caps_.name = "mouse";
  caps_.force_max_n = kForceMaxN;
  caps_.renders_force = false;
  caps_.buttons = 1;
}

void MouseDevice::aim(const Vec3& target) {
  targets_.back() = target;
  targets_.publish();
}

DeviceReading MouseDevice::read(Micros now) noexcept {
  if (const Vec3* target = targets_.take()) target_ = *target;
  const double dt = started_ ? std::max(0.0, seconds(now - read_)) : 0;
  started_ = true;
  read_ = now;
  // Beyond this lead the tool would be faster than kSpeedMaxMS: the target is moved towards it along the same line.
  const Vec3 lead = target_ - position_;
  const double most = 2 * kSpeedMaxMS / kPace, far = lead.norm();
  const Vec3 target = far > most ? Vec3(position_ + lead * (most / far)) : target_;
  const Vec3 e = position_ - target, c = velocity_ + kPace * e;
  const double fading = std::exp(-kPace * dt);
  position_ = target + (e + c * dt) * fading;
  velocity_ = (velocity_ - kPace * dt * c) * fading;
  if (clicked_.exchange(false)) pressed_until_ = now + kClick;
  DeviceReading reading{position_, DeviceState::ok};
  reading.buttons = now < pressed_until_ ? 1 : 0;
  return reading;
}

void MouseDevice::write(const Wrench& wrench) noexcept {
  feels_.back() = {position_, wrench.force};
  feels_.publish();
}

}  // namespace palpate
