// Finds the usable HID devices of this machine through hidapi and sysfs, including those that this user may not open.
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

/// Returns "force device", "six-axis mouse, no force" or "PID joystick, two axes".
const char* name_of(HidKind kind);

struct FoundHid {
  HidKind kind = HidKind::none;
  std::string path;    ///< for example /dev/hidraw3
  std::string model;   ///< maker and product as the device reports them
  std::string serial;  ///< may be empty
  std::uint16_t vendor = 0, product = 0;
  bool may_open = false;  ///< false: see the udev rules of Palpate (70-palpate.rules)
  std::string fault;      ///< fault of its descriptor, because of which its kind is unknown
};

/// Returns all devices but those of kind none, ordered by path. `sysfs`: location of the report descriptors.
std::vector<FoundHid> find_hid(const std::filesystem::path& sysfs = "/sys");

/// Opens a device; returns nullptr on failure, with the reason in `fault`. Uses one hidapi handle for the reader and one for the
/// writer, because a hidapi handle stores its last error without a lock.
std::unique_ptr<HidTransport> open_hid(const FoundHid& device, std::string& fault, const std::filesystem::path& sysfs = "/sys");

}  // namespace palpate
