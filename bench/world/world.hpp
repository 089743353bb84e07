// The simulated world: the real server and client cores, a body, devices and bad links, in virtual time on one thread.
//
// Nothing here computes a force or interprets a datagram: the cores do, the same objects that the programs run. The world only
// decides when things happen. Order at one moment t: datagrams that are due; the haptic tick of every station (on its
// millisecond); the clients' net side; the server; then again whatever these sent over links without delay, until nothing is
// left. One seed, one binary: the same bits.
//
// Clocks: world time starts at 0; every participant's own clock is world time plus an offset, so that no code can mistake one
// for another.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/core/client_core.hpp"
#include "client/device/motion_device.hpp"
#include "common/link/delay_queue.hpp"
#include "common/link/link_model.hpp"
#include "server/core/server_core.hpp"

namespace palpate {

struct WorldOptions {
  double rate_hz = 20;
  Micros compute{};        ///< from frame to patch: what a frame costs the server in virtual time
  std::uint64_t seed = 1;  ///< of clock offsets; links have their own
};

/// What a station does in its haptic tick; the default calls tick(). Experiments wrap it with a stopwatch.
using TickRunner = std::function<TickOutput(HapticTick&, const ToolSample&)>;
/// Hears of every tick: world time, tool position, what was felt.
using TickListener = std::function<void(Micros, const Vec3&, const TickOutput&)>;

class WorldStation {
 public:
  ClientCore& core() { return core_; }
  MotionDevice& device() { return *device_; }
  /// The station's own clock at world time t.
  Micros clock(Micros t) const { return t + offset_; }

  TickRunner run_tick = [](HapticTick& haptic, const ToolSample& sample) { return haptic.tick(sample); };
  TickListener on_tick;

 private:
  friend class World;
  WorldStation(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link, Micros offset);

  std::unique_ptr<MotionDevice> device_;
  Micros offset_;
  LinkModel up_, down_;
  ClientCore core_;
};

class World {
 public:
  World(const Scene& scene, const WorldOptions& options);

  /// `link` is one way; the way back is drawn from its seed plus one.
  WorldStation& add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link);
  /// Runs up to and including world time `until`.
  void run_until(Micros until);
  Micros now() const { return now_; }

  Room& room() { return room_; }
  const ServerCore& server() const { return server_; }

  /// What the server does with a frame; the default calls Room::run.
  std::function<FrameResult(Room&, const FrameJob&)> run_frame = [](Room& room, const FrameJob& job) { return room.run(job); };

 private:
  struct Datagram {
    std::size_t station;
    bool to_server;
    std::vector<std::byte> bytes;
  };
  struct Finished {
    FrameResult result;
  };

  void at_moment();
  bool deliver();
  void haptic_ticks();
  void client_net();
  void server_net();
  void send(std::size_t station, bool to_server, std::span<const std::byte> bytes);
  Micros next_moment() const;
  Micros server_clock() const { return now_ + server_offset_; }

  WorldOptions options_;
  Micros server_offset_;
  Room room_;
  ServerCore server_;
  std::vector<std::unique_ptr<WorldStation>> stations_;
  DelayQueue<Datagram> in_flight_;
  DelayQueue<Finished> computing_;
  Micros now_{};
  bool begun_ = false, room_started_ = false;
};

}  // namespace palpate
