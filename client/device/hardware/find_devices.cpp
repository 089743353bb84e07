#include "client/device/hardware/find_devices.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string_view>

#include "client/device/forcedimension/dhd_abi.hpp"
#include "client/device/hid/io/find_hid.hpp"
#include "client/device/inverse3/io/inverse3_device.hpp"
#include "client/device/openhaptics/hd_abi.hpp"
#include "common/base/error.hpp"

namespace palpate {

namespace {

namespace fs = std::filesystem;

enum class Node : std::uint8_t { usb, serial };

struct KnownUsb {
  std::string_view vendor, product;  ///< hexadecimal as in sysfs; empty product: all of the vendor's
  std::string_view kind, text;
  Node node;
};

constexpr std::array kKnownUsb{
    KnownUsb{"1451", "", "forcedimension", "Force Dimension", Node::usb},
    KnownUsb{"0403", "cb48", "forcedimension", "Novint Falcon", Node::usb},
    KnownUsb{"2988", "", "openhaptics", "3D Systems", Node::serial},
    KnownUsb{"0301", "2988", "openhaptics", "3D Systems Touch 3D Stylus", Node::serial},
};

std::string line_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// Returns the serial port that the kernel created for the device, under one of its interfaces.
fs::path serial_node(const fs::path& device, const fs::path& devices) {
  std::error_code ignored;
  for (const auto& interface : fs::directory_iterator(device, ignored))
    for (const auto& port : fs::directory_iterator(interface.path() / "tty", ignored)) return devices / port.path().filename();
  return {};
}

fs::path usb_node(const fs::path& device, const fs::path& devices) {
  const auto three = [](std::string number) { return std::string(3 - std::min<std::size_t>(3, number.size()), '0') + number; };
  const std::string bus = line_of(device / "busnum"), number = line_of(device / "devnum");
  return bus.empty() || number.empty() ? fs::path{} : devices / "bus/usb" / three(bus) / three(number);
}

std::string rule_of(const KnownUsb& known) {
  const bool serial = known.node == Node::serial;
  const std::string attribute = serial ? "ATTRS" : "ATTR";
  std::string rule = std::string("SUBSYSTEM==\"") + (serial ? "tty" : "usb") + "\", " + attribute + "{idVendor}==\"" +
                     std::string(known.vendor) + "\"";
  if (!known.product.empty()) rule += ", " + attribute + "{idProduct}==\"" + std::string(known.product) + "\"";
  return rule + ", TAG+=\"uaccess\"";
}

FoundDevice found(const KnownUsb& known, const fs::path& device, const fs::path& devices) {
  FoundDevice result;
  result.kind = known.kind;
  const std::string maker = line_of(device / "manufacturer"), product = line_of(device / "product");
  result.text = maker.empty() && product.empty() ? std::string(known.text) : maker + (maker.empty() ? "" : " ") + product;
  result.text += " (USB " + line_of(device / "idVendor") + ":" + line_of(device / "idProduct") + ")";
  result.node = known.node == Node::serial ? serial_node(device, devices) : usb_node(device, devices);
  result.usable = !result.node.empty() && access(result.node.c_str(), R_OK | W_OK) == 0;
  result.rule = rule_of(known);
  return result;
}

std::string hexadecimal4(std::uint16_t number) {
  char text[5];
  std::snprintf(text, sizeof text, "%04x", number);
  return text;
}

FoundDevice found(const FoundHid& hid) {
  const std::string vendor = hexadecimal4(hid.vendor), product = hexadecimal4(hid.product);
  FoundDevice result;
  result.kind = "hid";
  result.text = std::string(name_of(hid.kind)) + ": " + hid.model + (hid.serial.empty() ? "" : ", serial number " + hid.serial) +
                " (USB " + vendor + ":" + product + ")";
  result.node = hid.path;
  result.usable = hid.may_open;
  result.rule =
      "SUBSYSTEM==\"hidraw\", ATTRS{idVendor}==\"" + vendor + "\", ATTRS{idProduct}==\"" + product + "\", TAG+=\"uaccess\"";
  return result;
}

template <class Load>
FoundLibrary try_library(const char* kind, Load load) {
  try {
    FoundLibrary library;
    library.kind = kind;
    library.devices = load();
    return library;
  } catch (const InputError& error) {
    return {kind, error.what()};
  }
}

FoundLibrary try_inverse3() {
  try {
    FoundLibrary service{"inverse3", ""};
    std::string ids;
    for (const auto& device : find_inverse3()) ids += (ids.empty() ? "" : ", ") + device.id;
    service.works = "its service runs and lists " + (ids.empty() ? "no device" : ids);
    return service;
  } catch (const InputError& error) {
    return {"inverse3", error.what()};
  }
}

}  // namespace

std::vector<FoundDevice> find_usb_devices(const fs::path& system, const fs::path& devices) {
  std::vector<FoundDevice> result;
  std::vector<fs::path> places;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(system / "bus/usb/devices", ignored)) places.push_back(entry.path());
  std::sort(places.begin(), places.end());
  for (const fs::path& place : places) {
    const std::string vendor = line_of(place / "idVendor"), product = line_of(place / "idProduct");
    const auto known = std::find_if(kKnownUsb.begin(), kKnownUsb.end(), [&](const KnownUsb& k) {
      return k.vendor == vendor && (k.product.empty() || k.product == product);
    });
    if (known != kKnownUsb.end()) result.push_back(found(*known, place, devices));
  }
  return result;
}

std::vector<FoundDevice> find_hid_devices(const fs::path& system) {
  std::vector<FoundDevice> result;
  for (const FoundHid& hid : find_hid(system)) result.push_back(found(hid));
  return result;
}

std::vector<FoundLibrary> find_libraries() {
  const auto openhaptics = [] {
    hd::functions();
    return std::optional<int>();
  };
  return {try_library("openhaptics", openhaptics),
          try_library("forcedimension", [] { return std::optional(std::max(0, dhd::functions().dhdGetDeviceCount())); }),
          try_inverse3()};
}

std::string describe(const std::vector<FoundDevice>& devices, const std::vector<FoundLibrary>& libraries) {
  std::string text = devices.empty() ? "no haptic device is on this machine's USB\n" : "";
  std::vector<std::string> rules;
  for (const FoundDevice& device : devices) {
    text += device.kind + ": " + device.text + ", ";
    if (device.node.empty())
      text += "without a node of the kernel: its module is missing, or the device was just plugged in";
    else
      text += device.node.string() + (device.usable ? "" : ", which this user may not use");
    text += "\n";
    if (!device.usable && std::find(rules.begin(), rules.end(), device.rule) == rules.end()) rules.push_back(device.rule);
  }
  if (!rules.empty()) {
    text += "to get access, install the package palpate-client, or put this into /etc/udev/rules.d/60-palpate.rules:\n";
    for (const std::string& rule : rules) text += "  " + rule + "\n";
    text += "then: sudo udevadm control --reload && sudo udevadm trigger, and plug the device in again\n";
  }
  for (const FoundLibrary& library : libraries) {
    text += library.kind + ": " + (library.fault.empty() ? library.works : library.fault);
    if (library.devices)
      text += " and sees " + std::to_string(*library.devices) + (*library.devices == 1 ? " device" : " devices");
    text += "\n";
  }
  return text + "only their vendor's library knows devices on Ethernet, FireWire or a card\n";
}

}  // namespace palpate
