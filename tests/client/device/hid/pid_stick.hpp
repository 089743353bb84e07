// A PID joystick as bytes: a descriptor in one of two styles, and the reaction of a firmware to reports. Written from the class
// definition and independent of the host's code: offsets are constants here, as in a firmware.
//
// `arrays`: like small Arduino sticks: operations and device control as arrays, directions of 8 bits, magnitudes to +-10000,
// feature ids 5, 6. `flags`: like the boards of wheels: device control as bits, directions of 16 bits, a start delay, magnitudes
// to +-32767, other feature ids.
#pragma once

#include <array>
#include <map>
#include <vector>

#include "tests/client/device/hid/space_mouse_bytes.hpp"

namespace palpate::test {

enum class PidManner { arrays, flags };

class PidStick : public HidTransport {
 public:
  explicit PidStick(PidManner manner) : manner_(manner), descriptor_(bytes_of(descriptor_of(manner))) {}

  struct Effect {
    int duration_ms = 0, direction = 0, gain = 0, magnitude = 0, starts = 0;
    bool constant = false, direction_enabled = false, playing = false;
  };
  std::map<int, Effect> effects;
  bool enabled = false, plugged = true;
  int resets = 0, gain = 0, writes = 0, loads_until_ready = 2, room = 14;

  /// Force by the class definition: positive magnitude comes from `direction` (an angle in units of the descriptor, clockwise
  /// from away). x: right, y: away from the user; shares of full force.
  std::array<double, 2> force() const {
    std::array<double, 2> sum{};
    for (const auto& [index, effect] : effects) {
      if (!effect.playing || !effect.constant || !effect.direction_enabled || !enabled) continue;
      const double turn = manner_ == PidManner::arrays ? effect.direction / 255.0 : effect.direction / 36000.0;
      const double share = effect.magnitude / (manner_ == PidManner::arrays ? 10000.0 : 32767.0);
      sum[0] -= share * std::sin(2 * M_PI * turn);
      sum[1] -= share * std::cos(2 * M_PI * turn);
    }
    return sum;
  }

  static std::vector<std::uint8_t> report(int x, int y, std::uint8_t buttons) {
    return {1,
            buttons,
            static_cast<std::uint8_t>(x & 0xFF),
            static_cast<std::uint8_t>(x >> 8 & 0xFF),
            static_cast<std::uint8_t>(y & 0xFF),
            static_cast<std::uint8_t>(y >> 8 & 0xFF)};
  }

  std::span<const std::byte> descriptor() const override { return descriptor_; }
  int read(std::span<std::byte>, Micros) noexcept override { return plugged ? 0 : -1; }
  bool set_feature(std::span<const std::byte> r) noexcept override {
    if (at(r, 0) != create_id() || r.size() != 4 || at(r, 1) != 1) return false;
    pending_ = static_cast<int>(effects.size()) < room ? static_cast<int>(effects.size()) + 1 : 0;
    asked_ = 0;
    if (pending_ > 0) effects[pending_] = {};
    return true;
  }
  int get_feature(std::span<std::byte> r) noexcept override {
    if (at(r, 0) != create_id() + 1 || r.size() != 5) return -1;
    const bool ready = ++asked_ >= loads_until_ready;
    r[1] = static_cast<std::byte>(pending_);
    r[2] = static_cast<std::byte>(!ready ? 3 : pending_ > 0 ? 1 : 2);
    r[3] = r[4] = std::byte{1};
    return 5;
  }
  bool write(std::span<const std::byte> r) noexcept override {
    ++writes;
    if (!plugged) return false;
    switch (at(r, 0)) {
      case 1:
        return set_effect(r);
      case 5:
        if (r.size() != 4) return false;
        effects[at(r, 1)].magnitude = static_cast<std::int16_t>(word(r, 2));
        return true;
      case 0x0A:
        if (r.size() != 4) return false;
        effects[at(r, 1)].playing = at(r, 2) == 1;
        effects[at(r, 1)].starts += at(r, 2) == 1;
        return true;
      case 0x0C:
        return control(at(r, 1));
      case 0x0D:
        gain = at(r, 1);
        return true;
      default:
        return false;
    }
  }

 private:
  static int at(std::span<const std::byte> r, std::size_t i) { return std::to_integer<int>(r[i]); }
  static int word(std::span<const std::byte> r, std::size_t i) { return at(r, i) | at(r, i + 1) << 8; }
  int create_id() const { return manner_ == PidManner::arrays ? 5 : 0x11; }

  bool control(int value) {
    // Array: 1 enable, 4 reset, in the order of the usages; bits: 1 and 8.
    const int reset = manner_ == PidManner::arrays ? 4 : 8;
    if (value == 1) enabled = true;
    if (value == reset) {
      ++resets;
      effects.clear();
      enabled = false;
    }
    return value == 1 || value == reset;
  }

  bool set_effect(std::span<const std::byte> r) {
    const bool arrays = manner_ == PidManner::arrays;
    if (r.size() != (arrays ? 14u : 18u)) return false;
    Effect& effect = effects[at(r, 1)];
    effect.constant = at(r, 2) == 1;
    effect.duration_ms = word(r, 3);
    const std::size_t after = arrays ? 9 : 11;  // the start delay adds two bytes
    effect.gain = at(r, after);
    effect.direction_enabled = (at(r, after + 2) & 4) != 0;
    effect.direction = arrays ? at(r, 12) : word(r, 14);
    return true;
  }

  static std::vector<std::uint8_t> descriptor_of(PidManner manner) {
    const bool arrays = manner == PidManner::arrays;
    const std::uint8_t create = arrays ? 5 : 0x11, load = arrays ? 6 : 0x12;
    const std::vector<std::uint8_t> axes{0x05, 0x01, 0x09, 0x04, 0xA1, 0x01, 0x85, 0x01, 0x05, 0x09, 0x19, 0x01, 0x29, 0x08, 0x15,
                                         0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x08, 0x81, 0x02, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31,
                                         0x16, 0x01, 0x80, 0x26, 0xFF, 0x7F, 0x75, 0x10, 0x95, 0x02, 0x81, 0x02, 0x05, 0x0F};
    const std::vector<std::uint8_t> block_index{0x09, 0x22, 0x15, 0x01, 0x25, 0x28, 0x75, 0x08, 0x95, 0x01, 0x91, 0x02};
    const std::vector<std::uint8_t> types{0x09, 0x25, 0xA1, 0x02, 0x09, 0x26, 0x09, 0x27, 0x09,
                                          0x30, 0x15, 0x01, 0x25, 0x03, 0x75, 0x08, 0x95, 0x01};
    // Milliseconds: seconds, exponent -3.
    const std::vector<std::uint8_t> times{0x09, 0x50, 0x09, 0x54, 0x09, 0x51, 0x15, 0x00, 0x26, 0xFF, 0x7F,
                                          0x66, 0x01, 0x10, 0x55, 0x0D, 0x75, 0x10, 0x95, 0x03, 0x91, 0x02};
    const std::vector<std::uint8_t> delay{0x09, 0xA7, 0x95, 0x01, 0x91, 0x02};
    const std::vector<std::uint8_t> gain_and_trigger{0x55, 0x00, 0x65, 0x00, 0x09, 0x52, 0x26, 0xFF, 0x00, 0x75,
                                                     0x08, 0x95, 0x01, 0x91, 0x02, 0x09, 0x53, 0x91, 0x02};
    const std::vector<std::uint8_t> axes_enable{0x09, 0x55, 0xA1, 0x02, 0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x15,
                                                0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x02, 0x91, 0x02, 0xC0, 0x05,
                                                0x0F, 0x09, 0x56, 0x95, 0x01, 0x91, 0x02, 0x95, 0x05, 0x91, 0x03};
    const std::vector<std::uint8_t> direction_begins{0x09, 0x57, 0xA1, 0x02, 0x0B, 0x01, 0x00,
                                                     0x0A, 0x00, 0x0B, 0x02, 0x00, 0x0A, 0x00};
    const std::vector<std::uint8_t> direction8{0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x02, 0x91, 0x02, 0xC0};
    const std::vector<std::uint8_t> direction16{0x15, 0x00, 0x27, 0xA0, 0x8C, 0x00, 0x00,
                                                0x75, 0x10, 0x95, 0x02, 0x91, 0x02, 0xC0};
    const std::vector<std::uint8_t> magnitude10000{0x09, 0x70, 0x16, 0xF0, 0xD8, 0x26, 0x10,
                                                   0x27, 0x75, 0x10, 0x95, 0x01, 0x91, 0x02};
    const std::vector<std::uint8_t> magnitude32767{0x09, 0x70, 0x16, 0x01, 0x80, 0x26, 0xFF,
                                                   0x7F, 0x75, 0x10, 0x95, 0x01, 0x91, 0x02};
    const std::vector<std::uint8_t> operation{0x09, 0x78, 0xA1, 0x02, 0x09, 0x79, 0x09, 0x7A, 0x09, 0x7B,
                                              0x15, 0x01, 0x25, 0x03, 0x75, 0x08, 0x95, 0x01, 0x91, 0x00,
                                              0xC0, 0x09, 0x7C, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x91, 0x02};
    const std::vector<std::uint8_t> control_usages{0x09, 0x97, 0x09, 0x98, 0x09, 0x99, 0x09, 0x9A, 0x09, 0x9B, 0x09, 0x9C};
    const std::vector<std::uint8_t> control_array{0x15, 0x01, 0x25, 0x06, 0x75, 0x08, 0x95, 0x01, 0x91, 0x00};
    const std::vector<std::uint8_t> control_bits{0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95,
                                                 0x06, 0x91, 0x02, 0x95, 0x02, 0x91, 0x03};
    const std::vector<std::uint8_t> load_fields{
        0x09, 0x22, 0x15, 0x01, 0x25, 0x28, 0x75, 0x08, 0x95, 0x01, 0xB1, 0x02, 0x09, 0x8B, 0xA1, 0x02, 0x09, 0x8C, 0x09, 0x8D,
        0x09, 0x8E, 0x25, 0x03, 0xB1, 0x00, 0xC0, 0x09, 0xAC, 0x15, 0x00, 0x27, 0xFF, 0xFF, 0x00, 0x00, 0x75, 0x10, 0xB1, 0x00};
    return joined(
        {axes,
         {0x09, 0x21, 0xA1, 0x02, 0x85, 0x01},
         block_index,
         types,
         {0x91, 0x00, 0xC0},
         times,
         arrays ? std::vector<std::uint8_t>{} : delay,
         gain_and_trigger,
         axes_enable,
         direction_begins,
         arrays ? direction8 : direction16,
         {0xC0},
         {0x05, 0x0F, 0x09, 0x73, 0xA1, 0x02, 0x85, 0x05},
         block_index,
         arrays ? magnitude10000 : magnitude32767,
         {0xC0},
         {0x09, 0x77, 0xA1, 0x02, 0x85, 0x0A},
         block_index,
         operation,
         {0xC0},
         {0x09, 0x96, 0xA1, 0x02, 0x85, 0x0C},
         control_usages,
         arrays ? control_array : control_bits,
         {0xC0},
         {0x09, 0x7D, 0xA1, 0x02, 0x85, 0x0D, 0x09, 0x7E, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x01, 0x91, 0x02, 0xC0},
         {0x09, 0xAB, 0xA1, 0x02, 0x85, create},
         types,
         {0xB1, 0x00, 0xC0},
         {0x05, 0x01, 0x09, 0x3B, 0x15, 0x00, 0x26, 0xFF, 0x01, 0x75, 0x0A,
          0x95, 0x01, 0xB1, 0x02, 0x75, 0x06, 0xB1, 0x01, 0xC0, 0x05, 0x0F},
         {0x09, 0x89, 0xA1, 0x02, 0x85, load},
         load_fields,
         {0xC0},
         {0xC0}});
  }

  PidManner manner_;
  std::vector<std::byte> descriptor_;
  int pending_ = 0, asked_ = 0;
};

}  // namespace palpate::test
