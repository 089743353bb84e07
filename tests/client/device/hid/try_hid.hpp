// Arbitrary descriptors and reports: hosts of every kind try the device, and either refuse it with an InputError or read finite
// numbers within bounds.
#pragma once

#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "client/device/hid/force_joystick.hpp"
#include "client/device/hid/force_profile.hpp"
#include "client/device/hid/space_mouse.hpp"
#include "common/base/error.hpp"
#include "tests/client/device/hid/pid_stick.hpp"

namespace palpate::test {

/// Returns a descriptor, and repeats the other bytes whenever it is asked for a report.
class BabblingDevice : public HidTransport {
 public:
  BabblingDevice(std::span<const std::byte> descriptor, std::span<const std::byte> words)
      : descriptor_(descriptor), words_(words) {}
  std::span<const std::byte> descriptor() const override { return descriptor_; }
  int read(std::span<std::byte> report, Micros) noexcept override { return fill(report); }
  bool write(std::span<const std::byte> report) noexcept override { return report.size() <= ReportDescriptor::kMostReportBytes; }
  int get_feature(std::span<std::byte> report) noexcept override { return fill(report.subspan(1)) + 1; }
  bool set_feature(std::span<const std::byte>) noexcept override { return true; }

 private:
  int fill(std::span<std::byte> report) {
    for (std::byte& byte : report) byte = words_.empty() ? std::byte{0} : words_[at_++ % words_.size()];
    return static_cast<int>(report.size());
  }
  std::span<const std::byte> descriptor_, words_;
  std::size_t at_ = 0;
};

inline void abort_unless(bool holds) {
  if (!holds) std::abort();
}

/// Returns true if the protocol accepted the device.
inline bool try_protocol(HidProtocol& protocol, std::span<const std::byte> descriptor, std::span<const std::byte> words) {
  BabblingDevice device(descriptor, words);
  try {
    const DeviceCaps caps = protocol.begin(device);
    abort_unless(!caps.renders_force || (caps.force_max_n > 0 && caps.stiffness_max_n_m > 0 && !caps.workspace.isEmpty()));
  } catch (const InputError&) {
    return false;
  }
  HidInput input = protocol.unheard();
  std::vector<std::byte> report(256);
  for (std::size_t size = 0; size < report.size(); size += 1 + size / 8) {
    device.read(std::span(report).first(size), Micros{0});
    if (size > 0 && size % 2 == 0) report[0] = std::byte{1};
    protocol.take(std::span(report).first(size), input);
    const DeviceReading reading = protocol.read(input, Micros{static_cast<std::int64_t>(size) * 1000});
    abort_unless(reading.position.allFinite() && reading.position.norm() < 10);
    abort_unless(std::abs(reading.orientation.norm() - 1) < 1e-6);
    protocol.send(device, {Vec3(1, -1e9, 1e30), size % 3 != 0, true}, Micros{static_cast<std::int64_t>(size) * 1000});
  }
  return true;
}

/// Number of protocols that accepted the device.
inline int try_hid(std::span<const std::byte> descriptor, std::span<const std::byte> words) {
  ForceJoystickOptions stick;
  stick.force_max_n = 4;
  ForceProfile profile;
  SpaceMouse mouse{SpaceMouseOptions{}};
  ForceJoystick joystick(stick);
  int taken = 0;
  for (HidProtocol* protocol : std::initializer_list<HidProtocol*>{&profile, &mouse, &joystick})
    taken += try_protocol(*protocol, descriptor, words);
  return taken;
}

/// Our descriptors, one of each kind.
inline std::vector<std::vector<std::byte>> known_descriptors() {
  std::vector<std::vector<std::byte>> all{bytes_of(force_hid_descriptor), bytes_of(one_report_descriptor()),
                                          bytes_of(two_report_descriptor())};
  for (const PidManner manner : {PidManner::arrays, PidManner::flags}) {
    const PidStick stick(manner);
    all.emplace_back(stick.descriptor().begin(), stick.descriptor().end());
  }
  return all;
}

/// A feature report of a device of the profile, without its id, and three bytes that shift the following ones: 77 has no factor
/// in common with the length of a short report, so that each of its bytes is everywhere once.
inline std::vector<std::byte> known_words() {
  BenchDevice device;
  std::array<std::uint8_t, FORCE_HID_FEATURE_BYTES> feature{};
  force_hid_feature_report(&device.core, feature.data());
  auto words = bytes_of(std::span(feature).subspan(1));
  words.insert(words.end(), 3, std::byte{1});
  return words;
}

}  // namespace palpate::test
