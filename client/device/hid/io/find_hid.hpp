// Which HID devices of this machine can be used, asked of hidapi and of sysfs: also those that this user may not open.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/device/hid/hid_transport.hpp"

namespace palpate {

enum class HidKind : std::uint8_t {
  force_profile,   ///< client/device/hid/force_profile.hpp
  space_mouse,     ///< client/device/hid/space_mouse.hpp
  force_joystick,  ///< client/device/hid/force_joystick.hpp
  none
};

/// "force device", "six-axis mouse, no force", "PID joystick, two axes".
const char* name_of(HidKind kind);

struct FoundHid {
  HidKind kind = HidKind::none;
  std::string path;    ///< /dev/hidraw3
  std::string model;   ///< maker and product as the device says them
  std::string serial;  ///< may be empty
  std::uint16_t vendor = 0, product = 0;
  bool may_open = false;  ///< false: see the udev rules that come with Palpate (70-palpate.rules)
  std::string fault;      ///< why its kind is not known, where its descriptor is not right
};

/// All but those of kind none, in order of their paths. `sysfs` is where report descriptors are read.
std::vector<FoundHid> find_hid(const std::filesystem::path& sysfs = "/sys");

/// Opens it; nullptr where that fails, with the reason in `fault`. hidapi keeps a handle for the reader and one for the writer,
/// since one handle of its keeps the last error without a lock.
std::unique_ptr<HidTransport> open_hid(const FoundHid& device, std::string& fault, const std::filesystem::path& sysfs = "/sys");

}  // namespace palpate
