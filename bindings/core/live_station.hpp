// A station at a server whose hand is the calling program: it gives positions and gets forces, in real time.
//
//     LiveStation station({.server = "127.0.0.1:47800"});
//     station.wait(Micros{5'000'000});                          // joined, and the clocks agree
//     for each millisecond: force = station.tick({.position = position}).force
//
// A network thread of its own keeps the session (client/io/udp_client.hpp); the calling thread runs the haptic tick
// (client/core/haptic_tick.hpp). Ticks lie on a grid of 1 ms of CLOCK_MONOTONIC. The force is for display or control by the
// caller: no device is written, and only the limits given here clamp it. A program with a haptic device of its own uses
// HapticLoop and Device (docs/tutorials/your-own-device.md), which also watch that device.
//
// Units: metres, newtons, microseconds; frame W; forces act on the tool. Threads: tick() and follow() by one thread at a time;
// status(), wait() and welcome() by any.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "client/core/client_core.hpp"
#include "client/io/udp_client.hpp"

namespace palpate {

struct LiveOptions {
  std::string server;            ///< HOST:PORT
  std::string station = "hand";  ///< name; the server assigns a similar one when it is in use
  std::string room = {};         ///< one of the server's rooms; empty: its first
  std::string scheme = "auto";
  std::string key_file = {}, token_file = {};  ///< empty: none
  double force_max_n = 0, slew_max_n_s = 0;    ///< limits of the guard, 0 = not limited
  std::string tool = {};                       ///< name of the scene's tool that it holds; empty: the first
};

class LiveStation {
 public:
  /// Begins to join. Throws InputError for an address, scheme or key that cannot be read.
  explicit LiveStation(const LiveOptions& options);
  /// Leaves.
  ~LiveStation();
  LiveStation(const LiveStation&) = delete;
  LiveStation& operator=(const LiveStation&) = delete;

  /// Waits until the station has joined and the clocks agree. Throws std::runtime_error when the server refuses it, or after
  /// `most`, with the reason as palpate-client prints it.
  void wait(Micros most) const;
  ClientStatus status() const { return udp_.status(); }

  /// Runs the tick of the present millisecond with the tool at `pose`, whose time is not read. In the millisecond of the last
  /// tick it returns that again. A position that is not finite or outside the world counts as a tool that stands still,
  /// an orientation that is not of unit length as one that does not turn.
  TickOutput tick(const ToolSample& pose) noexcept;
  /// Moves the tool along `path`, a millisecond each, and writes the output of every tick; returns after path.size() ms. A tick
  /// that comes a millisecond late or more is skipped: the output before it is written again. Returns the number of those.
  std::size_t follow(std::span<const ToolSample> path, std::span<TickOutput> out) noexcept;
  /// Says goodbye to the server; the force of later ticks fades.
  void leave();

 private:
  Micros due(Micros now) const noexcept;
  const TickOutput& run(Micros t, const ToolSample& pose) noexcept;

  std::string server_;
  bool with_key_ = false;
  ClientCore core_;
  UdpClient udp_;
  Micros begin_;
  Micros last_{Micros::min()};
  TickOutput output_;
};

}  // namespace palpate
