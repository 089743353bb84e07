#include "client/mapping/mapped_device.hpp"

#include <algorithm>

namespace palpate {

MappedDevice::MappedDevice(Device& device, const WorkspaceMapping& mapping, const SceneSpot& spot, std::string_view where)
    : device_(device),
      mapping_(mapping),
      place_(spot.home + mapping.offset_m),
      turn_(mapping.scale * mapping.rotation()),
      rotation_(mapping.rotation()),
      force_turn_(mapping.force_scale * mapping.rotation().transpose()),
      torque_turn_(mapping.force_scale / mapping.scale * mapping.rotation().transpose()),
      tool_(place_) {
  const std::optional<Vec3> centre = centre_of(mapping, device.caps(), spot.grasps);
  if (centre) origin_ = place_ - turn_ * *centre;
  caps_ = mapped_caps(device.caps(), mapping, place_, centre, where);
}

bool MappedDevice::held(const std::optional<int>& button, std::uint32_t buttons, bool otherwise) const noexcept {
  return button ? (buttons >> *button & 1u) != 0 : otherwise;
}

void MappedDevice::follow(const Vec3& p_dt, bool engaged) noexcept {
  if (!origin_) origin_ = place_ - turn_ * p_dt;
  if (!placed_) tool_ = *origin_ + turn_ * p_dt;
  placed_ = true;
  if (engaged && !followed_ && mapping_.indexes()) origin_ = tool_ - turn_ * p_dt;
  if (engaged) tool_ = *origin_ + turn_ * p_dt;
  followed_ = engaged;
}

void MappedDevice::move_jaws(std::uint32_t buttons, Micros passed) noexcept {
  const double way = kJawsButton1S * seconds(passed);
  opening_ = std::clamp(opening_ + (held(mapping_.jaws_button, buttons, false) ? -way : way), 0.0, 1.0);
}

DeviceReading MappedDevice::read(Micros now) noexcept {
  DeviceReading reading = device_.read(now);
  const bool usable = reading.ok() && reading.position.allFinite();
  const Micros passed = well_ ? now - last_ : Micros{};
  last_ = now;
  well_ = reading.ok();
  if (!well_) {
    body_.reset();
    weight_.reset();
    followed_ = false;
  }
  const bool alive = held(mapping_.dead_man_button, reading.buttons, true);
  const bool engaged = alive && !held(mapping_.clutch_button, reading.buttons, false);
  if (usable) follow(reading.position, engaged);
  clock_.elapsed(now);
  reading.share *= body_.step(well_ && engaged && clock_.started(now), passed);
  weight_.step(well_ && alive, passed);
  // Positions that are not finite are passed on for the caller to notice.
  if (usable || !reading.ok()) reading.position = tool_;
  reading.orientation = rotation_ * reading.orientation;
  if (mapping_.jaws_button) {
    move_jaws(reading.buttons, passed);
    reading.opening = opening_;
  }
  return reading;
}

void MappedDevice::write(const Wrench& wrench) noexcept {
  const Wrench of_body = finite_parts(wrench);
  const Wrench at_device{body_.share() * (force_turn_ * of_body.force) - weight_.share() * mapping_.tool_weight_n,
                         body_.share() * (torque_turn_ * of_body.torque)};
  device_.write(limited_to(at_device, device_.caps().force_max_n, device_.caps().torque_max_nm));
}

void MappedDevice::stop() noexcept {
  body_.reset();
  weight_.reset();
  device_.stop();
}

void MappedDevice::resume() noexcept {
  body_.reset();
  weight_.reset();
  device_.resume();
}

}  // namespace palpate
