#include "client/device/hid/io/open_hid_device.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "client/device/hid/force_profile.hpp"
#include "client/device/hid/hid_settings.hpp"
#include "client/device/hid/io/find_hid.hpp"
#include "client/device/hid/io/hid_device.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr const char* kFlagHid = "--device hid";

bool is_named(const FoundHid& device, const std::string& which) {
  return which.empty() || device.serial == which || device.path == which ||
         std::filesystem::path(device.path).filename() == which;
}

std::string listed(const std::vector<FoundHid>& devices) {
  std::string text;
  for (const FoundHid& device : devices) {
    text += (text.empty() ? "" : ", ") + std::filesystem::path(device.path).filename().string() + " (" + name_of(device.kind);
    text += (device.model.empty() ? "" : ": " + device.model) +
            (device.serial.empty() ? "" : ", serial number " + device.serial) + ")";
  }
  return text;
}

FoundHid choose_device(const std::string& which, const std::filesystem::path& sysfs) {
  const auto all = find_hid(sysfs);
  std::vector<FoundHid> fitting;
  for (const FoundHid& device : all)
    if (is_named(device, which)) fitting.push_back(device);
  if (all.empty())
    throw InputError(kFlagHid, "none is plugged in", "a force device of the open profile, a six-axis mouse or a PID joystick");
  if (fitting.empty()) throw InputError(kFlagHid, "there is no \"" + which + "\"", "one of " + listed(all));
  if (fitting.size() > 1) throw InputError(kFlagHid, "several fit", "hid:WHICH with one of " + listed(fitting));
  if (!fitting[0].may_open)
    throw InputError(kFlagHid, fitting[0].path + " may not be opened by this user",
                     "the udev rules of palpate-client (docs/reference/devices.md), and the device plugged in anew");
  return fitting[0];
}

std::unique_ptr<HidProtocol> protocol_for(HidKind kind, const HidSettings& settings) {
  if (kind == HidKind::space_mouse) return std::make_unique<SpaceMouse>(settings.space_mouse());
  if (kind == HidKind::force_joystick) return std::make_unique<ForceJoystick>(settings.force_joystick());
  settings.force_profile();
  return std::make_unique<ForceProfile>();
}

bool is_like(const FoundHid& a, const FoundHid& b) {
  return a.kind == b.kind && a.vendor == b.vendor && a.product == b.product && a.serial == b.serial;
}

/// Opens the device at its node, or wherever it was plugged in again. `twins`: nodes of other devices that are like it.
std::unique_ptr<HidTransport> open_same(const FoundHid& first, const std::vector<std::string>& twins, std::string& fault,
                                        const std::filesystem::path& sysfs) {
  const auto all = find_hid(sysfs);
  const auto is_it = [&](const FoundHid& device) { return is_like(device, first) && device.path == first.path; };
  const auto may_be_it = [&](const FoundHid& device) {
    return is_like(device, first) && std::find(twins.begin(), twins.end(), device.path) == twins.end();
  };
  auto found = std::find_if(all.begin(), all.end(), is_it);
  if (found == all.end()) found = std::find_if(all.begin(), all.end(), may_be_it);
  if (found != all.end()) return open_hid(*found, fault, sysfs);
  fault = "is not plugged in";
  return nullptr;
}

}  // namespace

std::unique_ptr<Device> open_hid_device(std::string_view text, void (*on_thread)(), const std::filesystem::path& sysfs) {
  const HidSettings settings(text);
  const FoundHid device = choose_device(settings.which(), sysfs);
  HidDeviceOptions options;
  const std::string_view model = space_mouse_model(device.vendor, device.product);
  options.model = device.model.empty() ? std::string(model) : device.model;
  if (!device.serial.empty()) options.model += ", serial number " + device.serial;
  std::vector<std::string> twins;
  for (const FoundHid& other : find_hid(sysfs))
    if (is_like(other, device) && other.path != device.path) twins.push_back(other.path);
  options.open = [device, twins, sysfs](std::string& fault) { return open_same(device, twins, fault, sysfs); };
  options.on_thread = on_thread;
  return std::make_unique<HidDevice>(protocol_for(device.kind, settings), std::move(options));
}

}  // namespace palpate
