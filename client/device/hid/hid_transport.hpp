// An open HID device as bytes: reports in, reports out. Reports begin with their id, 0 where the device does not number them.
//
// One thread may read while another writes; features belong to set-up. read and write may block (Linux's write waits for the
// transfer), so neither is for the haptic thread.
#pragma once

#include <cstddef>
#include <span>

#include "common/base/types.hpp"

namespace palpate {

class HidTransport {
 public:
  virtual ~HidTransport() = default;
  virtual std::span<const std::byte> descriptor() const = 0;
  /// Returns the size of the next input report, 0 when none came within `wait`, negative when the device is gone.
  virtual int read(std::span<std::byte> report, Micros wait) noexcept = 0;
  /// Writes one output report. Returns false when the device is gone.
  virtual bool write(std::span<const std::byte> report) noexcept = 0;
  /// Reads the feature report with the id report[0]. Returns its size, negative when the device does not provide it.
  virtual int get_feature(std::span<std::byte> report) noexcept = 0;
  virtual bool set_feature(std::span<const std::byte> report) noexcept = 0;
};

}  // namespace palpate
