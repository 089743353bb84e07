// Simulated and replayed devices by kind, for any program: those of palpate-client --device.
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
  sim6,   ///< the same, which turns and renders a torque
  replay  ///< the tool follows `motion`, whatever force is written (replay_device.hpp)
};

struct DeviceOptions {
  DeviceKind kind = DeviceKind::sim;
  Hand hand{0.5, 6, 135};  ///< sim: the hand that holds the device; the default is "reference"
  std::uint64_t seed = 1;  ///< sim: seed of the hand's tremor
  double release_s = std::numeric_limits<double>::infinity();  ///< sim: motion time at which the hand releases the device
  bool stays_at_end = false;  ///< replay: true: the tool rests where `motion` ended; false: it is gone then
};

/// Returns a device that stands at the beginning of `motion` until MotionDevice::start(). Throws InputError when a number of
/// `options` is out of range.
std::unique_ptr<MotionDevice> make_device(const Motion& motion, const DeviceOptions& options = {});

}  // namespace palpate
