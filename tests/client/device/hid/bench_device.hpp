// A device of the force profile on a bench: the reference firmware with manually set encoders, and the bytes of its cable.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "client/device/hid/firmware/force_hid.h"

namespace palpate::test {

/// 8.5 N, 1.4 N continuous, 20 ms watchdog, no ramp, no torque.
inline force_hid_limits bench_limits() {
  force_hid_limits limits{};
  limits.firmware_version = 7;
  limits.rate_hz = 1000;
  limits.watchdog_ms = 20;
  limits.peak_mn = 8500;
  limits.continuous_mn = 1400;
  limits.heat_time_ds = 100;
  limits.stiffness_n_m = 1000;
  limits.slew_n_s = 2000;
  limits.speed_max_mm_s = 2000;
  for (int i = 0; i < 3; ++i) {
    limits.workspace_min_nm[i] = -100'000'000;
    limits.workspace_max_nm[i] = 100'000'000 + i;
  }
  limits.buttons = 2;
  limits.features = FORCE_HID_FEATURE_ORIENTATION;
  return limits;
}

/// The same with 0.3 N m, 0.05 N m continuous.
inline force_hid_limits turning_limits() {
  force_hid_limits limits = bench_limits();
  limits.features |= FORCE_HID_FEATURE_TORQUE;
  limits.peak_torque_unm = 300'000;
  limits.continuous_torque_unm = 50'000;
  limits.torque_slew_mnm_s = 75'000;
  limits.torsion_mnm_rad = 800;
  limits.spin_max_mrad_s = 30'000;
  return limits;
}

struct BenchDevice {
  force_hid_core core{};
  force_hid_sensors sensors{};
  std::uint32_t now_us = 0;
  std::uint16_t sequence = 0;
  std::array<std::int32_t, 3> force_mn{}, torque_unm{};

  explicit BenchDevice(const force_hid_limits& limits = bench_limits()) {
    force_hid_init(&core, &limits);
    sensors.homed = true;
  }

  /// Steps by `us`; returns the force on the motors.
  std::array<std::int32_t, 3> step(std::uint32_t us = 1000) {
    now_us += us;
    force_hid_step(&core, &sensors, now_us, force_mn.data(), torque_unm.data());
    return force_mn;
  }

  /// Sends the next output report.
  bool send(std::uint8_t flags, std::array<std::int32_t, 3> force = {}, std::array<std::int32_t, 3> torque = {}) {
    return send_as(++sequence, flags, force, torque);
  }
  bool send_as(std::uint16_t number, std::uint8_t flags, std::array<std::int32_t, 3> force = {},
               std::array<std::int32_t, 3> torque = {}) {
    std::array<std::uint8_t, FORCE_HID_OUTPUT_BYTES> report{FORCE_HID_OUTPUT_ID, static_cast<std::uint8_t>(number),
                                                            static_cast<std::uint8_t>(number >> 8), flags};
    for (std::size_t i = 0; i < 24; ++i) {
      const std::int32_t number_at = i < 12 ? force[i / 4] : torque[i / 4 - 3];
      report[4 + i] = static_cast<std::uint8_t>(static_cast<std::uint32_t>(number_at) >> (8 * (i % 4)));
    }
    return force_hid_receive(&core, report.data(), report.size(), now_us);
  }

  /// Moves to ARMED, with this wrench.
  void arm(std::array<std::int32_t, 3> force = {}, std::array<std::int32_t, 3> torque = {}) {
    step();
    send(0);
    step();
    send(FORCE_HID_FLAG_ARM, force, torque);
    step();
  }
};

}  // namespace palpate::test
