// The cable between a host and a device on the bench (bench_device.hpp), without threads or time of its own.
#pragma once

#include <algorithm>
#include <deque>
#include <vector>

#include "client/device/hid/hid_transport.hpp"
#include "tests/client/device/hid/bench_device.hpp"

namespace palpate::test {

inline std::vector<std::byte> bytes_of(std::span<const std::uint8_t> bytes) {
  std::vector<std::byte> result;
  for (const std::uint8_t byte : bytes) result.push_back(std::byte{byte});
  return result;
}

class BenchTransport : public HidTransport {
 public:
  explicit BenchTransport(BenchDevice& device) : descriptor_bytes(bytes_of(force_hid_descriptor)), device_(device) {}

  std::span<const std::byte> descriptor() const override { return descriptor_bytes; }
  int read(std::span<std::byte> report, Micros) noexcept override {
    if (!plugged) return -1;
    return static_cast<int>(force_hid_input_report(&device_.core, unsigned_bytes(report)));
  }
  bool write(std::span<const std::byte> report) noexcept override {
    flags.push_back(std::to_integer<std::uint8_t>(report[3]));
    if (plugged)
      force_hid_receive(&device_.core, reinterpret_cast<const std::uint8_t*>(report.data()), report.size(), device_.now_us);
    return plugged;
  }
  int get_feature(std::span<std::byte> report) noexcept override {
    std::array<std::uint8_t, FORCE_HID_FEATURE_BYTES> feature{};
    force_hid_feature_report(&device_.core, feature.data());
    const std::size_t size = std::min({report.size(), feature.size(), feature_bytes});
    std::copy_n(feature.begin(), size, unsigned_bytes(report));
    return static_cast<int>(size);
  }
  bool set_feature(std::span<const std::byte>) noexcept override { return false; }

  std::vector<std::byte> descriptor_bytes;
  std::vector<std::uint8_t> flags;  ///< flags of all output reports
  std::size_t feature_bytes = FORCE_HID_FEATURE_BYTES;
  bool plugged = true;

 private:
  static std::uint8_t* unsigned_bytes(std::span<std::byte> bytes) { return reinterpret_cast<std::uint8_t*>(bytes.data()); }
  BenchDevice& device_;
};

}  // namespace palpate::test
