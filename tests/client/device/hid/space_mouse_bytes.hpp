// Descriptors and reports of six-axis mice: an older model's (translation and rotation in separate reports, declared relative)
// and a newer one's (all in one, absolute).
#pragma once

#include <array>
#include <vector>

#include "client/device/hid/hid_transport.hpp"
#include "tests/client/device/hid/bench_transport.hpp"

namespace palpate::test {

/// A device that has only a descriptor.
class FixedTransport : public HidTransport {
 public:
  explicit FixedTransport(const std::vector<std::uint8_t>& bytes) : descriptor_(bytes_of(bytes)) {}
  std::span<const std::byte> descriptor() const override { return descriptor_; }
  int read(std::span<std::byte>, Micros) noexcept override { return 0; }
  bool write(std::span<const std::byte>) noexcept override { return true; }
  int get_feature(std::span<std::byte>) noexcept override { return -1; }
  bool set_feature(std::span<const std::byte>) noexcept override { return false; }

 private:
  std::vector<std::byte> descriptor_;
};

inline std::vector<std::uint8_t> joined(std::initializer_list<std::vector<std::uint8_t>> parts) {
  std::vector<std::uint8_t> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Items for `count` axes from `first` on, -350 to 350, in a physical collection.
inline std::vector<std::uint8_t> axes_items(std::uint8_t id, std::uint8_t first, std::uint8_t count, std::uint8_t flags) {
  return {0xA1, 0x00, 0x85, id,    0x16, 0xA2,  0xFE, 0x26, 0x5E, 0x01,  0x36, 0x88,
          0xFA, 0x46, 0x78, 0x05,  0x55, 0x0C,  0x65, 0x11, 0x19, first, 0x29, static_cast<std::uint8_t>(first + count - 1),
          0x75, 0x10, 0x95, count, 0x81, flags, 0xC0};
}

/// Items for buttons in report 3, then a light in output report 4.
inline std::vector<std::uint8_t> buttons_and_light(std::uint8_t buttons) {
  return {0xA1, 0x02, 0x85,    0x03, 0x05,    0x01, 0x05,
          0x09, 0x19, 0x01,    0x29, buttons, 0x15, 0x00,
          0x25, 0x01, 0x35,    0x00, 0x45,    0x01, 0x75,
          0x01, 0x95, buttons, 0x81, 0x02,    0x95, static_cast<std::uint8_t>(8 - buttons % 8),
          0x81, 0x03, 0xC0,    0xA1, 0x02,    0x85, 0x04,
          0x05, 0x08, 0x09,    0x4B, 0x15,    0x00, 0x25,
          0x01, 0x75, 0x01,    0x95, 0x01,    0x91, 0x02,
          0x95, 0x07, 0x91,    0x03, 0xC0};
}

inline std::vector<std::uint8_t> two_report_descriptor() {
  constexpr std::uint8_t kRelative = 0x06;
  return joined({{0x05, 0x01, 0x09, 0x08, 0xA1, 0x01},
                 axes_items(1, 0x30, 3, kRelative),
                 axes_items(2, 0x33, 3, kRelative),
                 buttons_and_light(2),
                 {0xC0}});
}

inline std::vector<std::uint8_t> one_report_descriptor() {
  return joined({{0x05, 0x01, 0x09, 0x08, 0xA1, 0x01}, axes_items(1, 0x30, 6, 0x02), buttons_and_light(2), {0xC0}});
}

inline std::vector<std::uint8_t> three_axes(std::uint8_t id, int a, int b, int c) {
  std::vector<std::uint8_t> report{id};
  for (const int v : {a, b, c}) {
    report.push_back(static_cast<std::uint8_t>(v & 0xFF));
    report.push_back(static_cast<std::uint8_t>(v >> 8 & 0xFF));
  }
  return report;
}

inline std::vector<std::uint8_t> six_axes(const std::array<std::int16_t, 6>& raw) {
  return joined({three_axes(1, raw[0], raw[1], raw[2]), [&] {
                   auto rest = three_axes(1, raw[3], raw[4], raw[5]);
                   rest.erase(rest.begin());
                   return rest;
                 }()});
}

}  // namespace palpate::test
