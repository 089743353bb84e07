// The device that a station reads and writes, by its kind: what palpate-client --device names, for any program.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>

#include "client/device/hand.hpp"
#include "client/device/motion_device.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

enum class DeviceKind : std::uint8_t {
  sim,    ///< a simulated Phantom 1.5 in a simulated hand that intends `motion` (sim_phantom.hpp)
  replay  ///< the tool is where `motion` says, whatever force is written (replay_device.hpp)
};

struct DeviceOptions {
  DeviceKind kind = DeviceKind::sim;
  Hand hand{0.5, 6, 135};                                      ///< sim: that holds the device; the default is "reference"
  std::uint64_t seed = 1;                                      ///< sim: of the hand's tremor
  double release_s = std::numeric_limits<double>::infinity();  ///< sim: motion time at which the hand lets go
  bool stays_at_end = false;  ///< replay: the tool rests where `motion` ended; else it is gone then
};

/// Stands at the beginning of `motion` until MotionDevice::start(). Throws InputError when a number of `options` is out of range.
std::unique_ptr<MotionDevice> make_device(const Motion& motion, const DeviceOptions& options = {});

}  // namespace palpate
