#include "client/device/hid/space_mouse.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "client/device/mouse_device.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t kDesktop = 0x01, kMultiAxis = 0x08, kX = 0x30, kButtonPage = 0x09;
constexpr int kMostButtons = 32;
constexpr std::uint16_t kLogitech = 0x046D, k3Dconnexion = 0x256F;

struct Model {
  std::uint16_t vendor, product;
  std::string_view name;
};

constexpr Model kModels[] = {
    {kLogitech, 0xC603, "SpaceMouse Plus XT"},
    {kLogitech, 0xC605, "CadMan"},
    {kLogitech, 0xC606, "SpaceMouse Classic"},
    {kLogitech, 0xC621, "SpaceBall 5000"},
    {kLogitech, 0xC623, "SpaceTraveler"},
    {kLogitech, 0xC625, "SpacePilot"},
    {kLogitech, 0xC626, "SpaceNavigator"},
    {kLogitech, 0xC627, "SpaceExplorer"},
    {kLogitech, 0xC628, "SpaceNavigator for Notebooks"},
    {kLogitech, 0xC629, "SpacePilot Pro"},
    {kLogitech, 0xC62B, "SpaceMouse Pro"},
    {k3Dconnexion, 0xC62E, "SpaceMouse Wireless (cable)"},
    {k3Dconnexion, 0xC62F, "SpaceMouse Wireless (receiver)"},
    {k3Dconnexion, 0xC631, "SpaceMouse Pro Wireless (cable)"},
    {k3Dconnexion, 0xC632, "SpaceMouse Pro Wireless (receiver)"},
    {k3Dconnexion, 0xC633, "SpaceMouse Enterprise"},
    {k3Dconnexion, 0xC635, "SpaceMouse Compact"},
    {k3Dconnexion, 0xC636, "SpaceMouse Module"},
    {k3Dconnexion, 0xC638, "SpaceMouse Pro Wireless (Bluetooth)"},
    {k3Dconnexion, 0xC63A, "SpaceMouse Wireless (Bluetooth)"},
    {k3Dconnexion, 0xC652, "3Dconnexion Universal Receiver"},
};

/// Returns the share of the largest speed at a deflection of this length.
double speed_share(double deflection) noexcept {
  const double s = std::clamp((deflection - SpaceMouse::kDeadZone) / (1 - SpaceMouse::kDeadZone), 0.0, 1.0);
  return s * s;
}

/// Returns the shares of the largest speed along a deflection.
Vec3 shaped(const Vec3& deflection) noexcept {
  const double length = deflection.norm();
  return length > 0 ? Vec3(deflection * (speed_share(length) / length)) : Vec3(Vec3::Zero());
}

Eigen::Quaterniond turned(const Vec3& angle) noexcept {
  const double length = angle.norm();
  return length > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(length, angle / length)) : Eigen::Quaterniond::Identity();
}

}  // namespace

std::string_view space_mouse_model(std::uint16_t vendor, std::uint16_t product) {
  for (const Model& model : kModels)
    if (model.vendor == vendor && model.product == product) return model.name;
  return {};
}

AxisMap AxisMap::from_text(std::string_view text) {
  const auto fail = [&] {
    throw InputError("axes", "\"" + std::string(text) + "\"",
                     "x, y and z once each, with signs that do not mirror, as in \"x -y -z\"");
  };
  AxisMap map;
  map.matrix.setZero();
  int row = 0;
  double sign = 1;
  for (const char c : text) {
    if (c == '-') sign = -1;
    if (c == '-' || c == '+' || c == ' ') continue;
    if (c < 'x' || c > 'z' || row == 3) fail();
    map.matrix(row++, c - 'x') = sign;
    sign = 1;
  }
  if (row != 3 || map.matrix.determinant() != 1) fail();
  return map;
}

SpaceMouse::SpaceMouse(const SpaceMouseOptions& options) : options_(options), position_(options.start) {
  if (!options.workspace.contains(options.start))
    throw InputError("space mouse", "the tool begins outside of the workspace", "a start within it");
}

bool SpaceMouse::is(const ReportDescriptor& descriptor) {
  const std::uint32_t controller = hid_usage(kDesktop, kMultiAxis);
  for (std::uint32_t axis = 0; axis < 6; ++axis)
    if (!descriptor.find(HidReportKind::input, hid_usage(kDesktop, kX + axis), controller)) return false;
  return true;
}

DeviceCaps SpaceMouse::begin(HidTransport& transport) {
  const ReportDescriptor descriptor(transport.descriptor());
  if (!is(descriptor)) throw InputError("space mouse", "its report descriptor has no six axes", "a multi-axis controller");
  for (std::uint32_t i = 0; i < 6; ++i) {
    axes_[i].field = *descriptor.find(HidReportKind::input, hid_usage(kDesktop, kX + i), hid_usage(kDesktop, kMultiAxis));
    if (axes_[i].field.logical_max > 0) axes_[i].full = static_cast<double>(axes_[i].field.logical_max);
  }
  buttons_.clear();
  for (const HidField& field : descriptor.fields())
    if (field.kind == HidReportKind::input && !field.array && field.bits == 1 && field.usage >> 16 == kButtonPage &&
        buttons_.size() < kMostButtons)
      buttons_.push_back(field);
  DeviceCaps caps;
  caps.name = "hid";
  caps.renders_force = false;
  caps.force_max_n = MouseDevice::kForceMaxN;  // like the pointer: the picture shows what a hand could feel
  caps.slew_max_n_s = SimPhantom::kSlewMaxNS;
  caps.has_orientation = true;
  caps.buttons = static_cast<int>(buttons_.size());
  caps.workspace = options_.workspace;
  return caps;
}

Micros SpaceMouse::silence_max(const HidInput& input) const noexcept {
  const auto pushed = [](double deflection) { return std::abs(deflection) > kDeadZone; };
  return std::any_of(input.deflection.begin(), input.deflection.end(), pushed) ? kSilenceMax : Micros{0};
}

bool SpaceMouse::take(std::span<const std::byte> report, HidInput& input) noexcept {
  bool known = false;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (!holds(axes_[i].field, report)) continue;
    known = true;
    input.deflection[i] = std::clamp(static_cast<double>(value_of(axes_[i].field, report)) / axes_[i].full, -1.0, 1.0);
  }
  for (std::size_t i = 0; i < buttons_.size(); ++i) {
    if (!holds(buttons_[i], report)) continue;
    known = true;
    const std::uint32_t bit = 1u << i;
    input.reading.buttons = value_of(buttons_[i], report) != 0 ? input.reading.buttons | bit : input.reading.buttons & ~bit;
  }
  if (known) input.reading.state = DeviceState::ok;
  return known;
}

void SpaceMouse::move(const Vec3& push, const Vec3& turn, double dt) noexcept {
  if (options_.control == SpaceMouseOptions::Control::rate) {
    velocity_ = options_.speed_max_m_s * shaped(push);
    position_ += velocity_ * dt;
    orientation_ = (turned(options_.turn_max_rad_s * dt * shaped(turn)) * orientation_).normalized();
  } else {
    // critically damped towards the target, exact over the tick (mouse_device.hpp)
    const Vec3 target = options_.start + options_.reach_m * push;
    const Vec3 e = position_ - target, c = velocity_ + kPace * e;
    const double fading = std::exp(-kPace * dt);
    position_ = target + (e + c * dt) * fading;
    velocity_ = (velocity_ - kPace * dt * c) * fading;
    orientation_ = orientation_.slerp(1 - fading, turned(M_PI_2 * turn));
  }
  position_ = position_.cwiseMax(options_.workspace.min()).cwiseMin(options_.workspace.max());
}

DeviceReading SpaceMouse::read(const HidInput& input, Micros now) noexcept {
  const double dt = started_ ? seconds(std::clamp(now - read_, Micros{0}, kLongestTick)) : 0;
  started_ = true;
  read_ = now;
  const auto& d = input.deflection;
  if (input.reading.ok()) move(options_.axes.matrix * Vec3(d[0], d[1], d[2]), options_.axes.matrix * Vec3(d[3], d[4], d[5]), dt);
  DeviceReading reading = input.reading;
  reading.position = position_;
  reading.orientation = orientation_;
  return reading;
}

}  // namespace palpate
