// How tests command a stand-in: a shared library with a vendor's C interface over the simulated Phantom, in the vendor's frame
// and units, that keeps the vendor's rules and can be told to misbehave. No vendor's code is in it and none was run beside it.
//
// It is loaded as the vendor's library would be, by the environment variable that names a file; palpate_standin() in it returns
// this interface. In a program of its own it is set up by the environment:
//     STANDIN_MOTION=FILE.csv  what the hand intends        STANDIN_HAND=free|light|reference|firm
//     STANDIN_FAULT=NAME@S     misbehaves from then on       STANDIN_LOG=FILE   a line "t_s x y z fx fy fz" a tick, at once
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
  force_limit,     ///< the driver's limit of force was exceeded: no force
  velocity_limit,  ///< that of velocity
  lost,            ///< the cable is out: every call says so, no force
  silent,          ///< the driver stops calling, or moving, without a word
  blocks,          ///< a call does not return
  jump,            ///< the position is 30 mm off from now on
  nan,             ///< the position is not a number
  other_thread,    ///< the driver calls from another thread every time
  button_off,      ///< the person switched the force off at the device
  mirrored         ///< its motors are wired the wrong way round
};
inline constexpr std::string_view kStandinFaults[] = {
    "none",   "no_device", "not_calibrated", "hot", "force_limit",  "velocity_limit", "lost",
    "silent", "blocks",    "jump",           "nan", "other_thread", "button_off",     "mirrored"};

/// One millisecond of the device, frame W.
struct StandinTick {
  Vec3 position = Vec3::Zero();  ///< of the tool, behind the quantised reading [m]
  Vec3 force = Vec3::Zero();     ///< rendered from this tick to the next [N]
};

class Standin {
 public:
  virtual ~Standin() = default;
  /// A new arm in a new hand that does not misbehave. While no device is open. Its motion starts with the first tick.
  virtual void begin(const Motion& intention, const SimPhantomOptions& hand) = 0;
  /// The hand rests where its motion begins until start(), which says how long ago that was at the next tick.
  virtual void wait_for_start() = 0;
  virtual void start(Micros ago) = 0;
  /// Time passes only by tick(), which returns when a millisecond with all that belongs to it is over.
  virtual void by_hand(bool yes) = 0;
  virtual void tick() = 0;
  virtual void misbehave(StandinFault fault) = 0;
  virtual void press(unsigned int buttons) = 0;
  /// The person does what calibration asks for.
  virtual void calibrate() = 0;
  /// A device is open.
  virtual bool in_use() const = 0;
  virtual std::vector<StandinTick> log() const = 0;
  /// What the user of the library did against its rules.
  virtual std::vector<std::string> breaches() const = 0;
};

}  // namespace palpate

extern "C" palpate::Standin* palpate_standin();
