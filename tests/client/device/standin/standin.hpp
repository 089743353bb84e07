// Interface by which tests control a stand-in: a shared library with a vendor's C interface over the simulated Phantom, in the
// vendor's frame and units, that follows the vendor's rules and can simulate faults. It contains no vendor's code, and none was
// run next to it.
//
// It is loaded like the vendor's library, by the environment variable that names a file; palpate_standin() in it returns this
// interface. In a program of its own it is configured by the environment:
//     STANDIN_MOTION=FILE.csv  intention of the hand         STANDIN_HAND=free|light|reference|firm
//     STANDIN_FAULT=NAME@S     fault from that time on       STANDIN_LOG=FILE   a line "t_s x y z fx fy fz" per tick, unbuffered
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/device/sim_phantom.hpp"
#include "common/motion/motion.hpp"

namespace palpate {

enum class StandinFault : std::uint8_t {
  none,
  no_device,       ///< nothing is plugged in
  not_calibrated,  ///< until calibrate()
  hot,             ///< the motors are too hot: no force
  force_limit,     ///< the driver's force limit was exceeded: no force
  velocity_limit,  ///< the driver's velocity limit was exceeded: no force
  lost,            ///< the cable is unplugged: every call reports it, no force
  silent,          ///< the driver stops calling, or moving, without an error
  blocks,          ///< a call does not return
  jump,            ///< the position is 30 mm off from then on
  nan,             ///< the position is not a number
  other_thread,    ///< the driver calls from another thread every time
  button_off,      ///< the user switched the force off at the device
  mirrored,        ///< its motors are wired in reverse
  no_torque        ///< its library does not know how to render a torque
};
inline constexpr std::string_view kStandinFaults[] = {
    "none", "no_device", "not_calibrated", "hot",        "force_limit", "velocity_limit", "lost", "silent", "blocks",
    "jump", "nan",       "other_thread",   "button_off", "mirrored",    "no_torque"};

/// One millisecond of the device, frame W.
struct StandinTick {
  Vec3 position = Vec3::Zero();  ///< tool position before quantisation of the reading [m]
  Vec3 force = Vec3::Zero();     ///< rendered from this tick to the next [N]
  Rotation turn = Rotation::Identity();
  Vec3 torque = Vec3::Zero();  ///< rendered likewise [N m]
};

class Standin {
 public:
  virtual ~Standin() = default;
  /// Starts a new arm in a new hand, one with motors for rotation where `hand` has a wrist, without faults, while no device is
  /// open. Its motion starts with the first tick.
  virtual void begin(const Motion& intention, const SimPhantomOptions& hand) = 0;
  /// The hand rests at the start of its motion until start(), which gives the time since the start at the next tick.
  virtual void wait_for_start() = 0;
  virtual void start(Micros ago) = 0;
  /// Time advances only in tick(), which returns when a millisecond with its callbacks is over.
  virtual void by_hand(bool yes) = 0;
  virtual void tick() = 0;
  virtual void misbehave(StandinFault fault) = 0;
  virtual void press(unsigned int buttons) = 0;
  /// The user performs the calibration.
  virtual void calibrate() = 0;
  /// Returns true while a device is open.
  virtual bool in_use() const = 0;
  virtual std::vector<StandinTick> log() const = 0;
  /// Violations of the library's rules by its user.
  virtual std::vector<std::string> breaches() const = 0;
};

}  // namespace palpate

extern "C" palpate::Standin* palpate_standin();
