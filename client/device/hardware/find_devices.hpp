// Which devices are plugged in, whether this user may use them, and whether the vendors' libraries can be loaded. What is on USB
// is found by the kernel's list (sysfs), without opening anything, so that a device that this user may not use is found too; a
// device on Ethernet, FireWire or a card is known to its vendor's library alone.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

struct FoundDevice {
  std::string kind;            ///< as --device takes it; empty: nothing here drives it
  std::string text;            ///< maker and product as the device says them, with its USB numbers
  std::filesystem::path node;  ///< through which it is used; empty: it has none, its driver is missing
  bool usable = false;         ///< this user may read and write the node
  std::string rule;            ///< of udev, that lets the person at the machine use it
};

struct FoundLibrary {
  std::string kind;
  std::string fault;             ///< empty: it can be loaded
  std::optional<int> devices{};  ///< that it sees; not every library says it
};

/// `system`, `devices`: where sysfs and the nodes are, for tests.
std::vector<FoundDevice> find_usb_devices(const std::filesystem::path& system = "/sys",
                                          const std::filesystem::path& devices = "/dev");

/// Of use with --device hid, asked of hidapi, the ones that may not be opened too.
std::vector<FoundDevice> find_hid_devices(const std::filesystem::path& system = "/sys");

std::vector<FoundLibrary> find_libraries();

/// For a person; with what to do about what is missing.
std::string describe(const std::vector<FoundDevice>& devices, const std::vector<FoundLibrary>& libraries);

}  // namespace palpate
