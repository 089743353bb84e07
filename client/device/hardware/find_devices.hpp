// Finds the devices that are plugged in, whether this user may use them, and whether the vendors' libraries can be loaded. USB
// devices are found in the kernel's list (sysfs), without opening anything, so that a device that this user may not use is found
// too. A device on Ethernet, FireWire or a card is known to its vendor's library alone.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

struct FoundDevice {
  std::string kind;            ///< kind as in --device; empty: no driver here
  std::string text;            ///< maker and product as the device reports them, with its USB numbers
  std::filesystem::path node;  ///< device node through which it is used; empty: none, its driver is missing
  bool usable = false;         ///< true: this user may read and write the node
  std::string rule;            ///< udev rule that grants the person at the machine access
};

struct FoundLibrary {
  std::string kind;
  std::string fault;             ///< empty: the library can be loaded
  std::optional<int> devices{};  ///< number of devices that it sees, if the library reports it
  std::string works = "its library can be loaded";
};

/// `system`, `devices`: locations of sysfs and of the nodes, for tests.
std::vector<FoundDevice> find_usb_devices(const std::filesystem::path& system = "/sys",
                                          const std::filesystem::path& devices = "/dev");

/// Returns the devices that --device hid can use, found through hidapi, including those that may not be opened.
std::vector<FoundDevice> find_hid_devices(const std::filesystem::path& system = "/sys");

/// Returns the vendors' libraries, and Haply's Inverse Service.
std::vector<FoundLibrary> find_libraries();

/// Returns a text for a person, with a remedy for everything that is missing.
std::string describe(const std::vector<FoundDevice>& devices, const std::vector<FoundLibrary>& libraries);

}  // namespace palpate
