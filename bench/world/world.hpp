// The simulated world: the real server and client cores, a body, devices and bad links, in virtual time on one thread.
//
// Nothing here computes a force or interprets a datagram: the cores do, with the same classes as in the programs. The world only
// decides when things happen. Order at one moment t: events of at(); datagrams that are due; the haptic tick of every station (on
// the milliseconds of its own clock); the clients' net side; the server; then again whatever these sent over links without delay,
// until nothing is left. One seed and one binary give the same bits.
//
// World time starts at 0; every participant has a clock of its own (world_clock.hpp), so that no code can mistake one for
// another.
//
// Everything that can happen to a participant is a call that takes effect at the present moment; World::at() schedules one for
// later. A stalled participant receives and emits nothing until it resumes; datagrams wait for it in a socket buffer of
// kSocketBuffer datagrams, and further ones are lost, as on a real machine. Datagrams to a participant that is down are lost.
//
// With keys all datagrams pass through the trust channel, as in the programs; listeners see their content. Links count a datagram
// of the session without the channel's overhead, and handshakes draw their delays and losses from their own generators, so that
// the session's datagrams have the same fate as without keys.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/world/world_clock.hpp"
#include "bench/world/world_trust.hpp"
#include "client/core/client_core.hpp"
#include "client/device/motion_device.hpp"
#include "common/link/delay_queue.hpp"
#include "common/link/link_model.hpp"
#include "server/core/server_core.hpp"

namespace palpate {

/// Server time of a frame; `patches` includes the rollouts.
struct FrameTimes {
  Micros step{}, patches{}, rollouts{};
};

struct WorldOptions {
  double rate_hz = 20;
  Micros compute{};        ///< from frame to patch: the cost of a frame for the server in virtual time
  std::uint64_t seed = 1;  ///< seed of clock offsets; links have their own
  double server_drift_ppm = 0;
  double deadband = 0;  ///< see ServerOptions
  std::optional<WorldKeys> keys = {};
  bool once = false;  ///< copies made by links are dropped on arrival, as by the trust channel
  /// If given, replaces `compute`: times of a frame that begins at this world time and has this result.
  std::function<FrameTimes(Micros, const FrameJob&, const FrameResult&)> frame_times = {};
  FrameCosts::Expected expected_costs = {};  ///< costs that the server knows before its first frame
};

/// Performs a station's haptic tick; the default calls tick(). Experiments wrap it with a stopwatch.
using TickRunner = std::function<TickOutput(HapticTick&, const ToolSample&)>;
/// Called at every tick with world time, tool position and the output.
using TickListener = std::function<void(Micros, const Vec3&, const TickOutput&)>;

/// One datagram between a station and the server. A copy made by the link has the same number. `brought`: an attacker delivered
/// it late, possibly after the link had lost it; it has no number. Reported only towards the server, if its receiver opens it,
/// and for a station's present process.
struct DatagramEvent {
  enum class Kind : std::uint8_t { sent, lost, delivered, brought };
  Kind kind = Kind::sent;
  std::uint64_t number = 0;
  std::size_t station = 0;
  bool to_server = false;
  std::span<const std::byte> bytes;
};
using DatagramListener = std::function<void(Micros, const DatagramEvent&)>;

/// A datagram as an attacker on the path sees it, at the time of sending.
struct WireEvent {
  std::size_t station = 0;
  ChannelAddress client;  ///< address of the station's end
  bool to_server = false;
  std::span<const std::byte> bytes;
};

inline constexpr std::size_t kSocketBuffer = 256;  ///< datagrams; the usual 208 KiB with the kernel's overhead for each

class WorldStation {
 public:
  ClientCore& core() { return *core_; }
  const ClientCore& core() const { return *core_; }
  /// Not for a shadow.
  MotionDevice& device() { return *device_; }
  /// The station's own clock at world time t.
  Micros clock(Micros t) const { return clock_.at(t); }
  bool up() const { return up_ && !leaving_; }
  bool asleep() const { return asleep_since_.has_value(); }
  int lives() const { return lives_; }  ///< processes so far

  TickRunner run_tick = [](HapticTick& haptic, const ToolSample& sample) { return haptic.tick(sample); };
  TickListener on_tick;

  // Faults:
  void change_link(const LinkSpec& up, const LinkSpec& down);
  void cut(bool up, bool down);     ///< datagrams in flight still arrive
  void stall_net(bool stalled);     ///< its net side stands still, its haptic thread continues
  void stall_haptic(bool stalled);  ///< and vice versa
  void step_clock(Micros by) { clock_.step(by); }
  void sleep(Micros now);  ///< its machine is suspended: nothing runs, nothing is received, its clock stands still
  void wake(Micros now);
  void leave();  ///< says goodbye; its haptic thread ends
  void crash();  ///< without a goodbye
  /// Starts a new process with the same name and another address.
  void join_again(Micros now);

 private:
  friend class World;
  struct Waiting {
    std::uint64_t number;
    std::vector<std::byte> bytes, sealed;
  };
  WorldStation(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& up, const LinkSpec& down,
               const WorldClock& clock, Micros now);
  void new_core(Micros now);
  bool net_runs() const { return up_ && !net_stalled_ && !asleep(); }
  bool haptic_runs() const { return up_ && !haptic_stalled_ && !asleep(); }

  ClientOptions options_;
  std::unique_ptr<MotionDevice> device_;
  const WorldStation* owner_ = nullptr;  ///< owner of the tool, for a shadow
  WorldClock clock_;
  LinkModel up_link_, down_link_, channel_up_, channel_down_;
  bool cut_up_ = false, cut_down_ = false, net_stalled_ = false, haptic_stalled_ = false, up_ = true, leaving_ = false;
  std::optional<Micros> asleep_since_;
  std::unique_ptr<ClientCore> core_;
  int lives_ = 0;
  PeerId peer_ = 0;  ///< this process; 0: it has none yet
  Micros next_tick_{};
  DeviceReading reading_;
  std::deque<Waiting> waiting_;
};

class World {
 public:
  World(const Scene& scene, const WorldOptions& options);

  /// `link` is one way; the way back is drawn from its seed plus one.
  WorldStation& add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& link);
  WorldStation& add_station(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& up,
                            const LinkSpec& down, double drift_ppm);
  /// Adds a station that feels with the tool of `owner`, in the same process: one clock.
  WorldStation& add_shadow(const ClientOptions& options, const WorldStation& owner, const LinkSpec& up, const LinkSpec& down);
  /// Runs up to and including world time `until`.
  void run_until(Micros until);
  Micros now() const { return now_; }
  /// Schedules `event` at world time t (not in the past), before everything else there; events of one moment run in the order of
  /// entry.
  void at(Micros t, std::function<void()> event) { events_.push(t, std::move(event)); }

  Room& room() { return room_; }
  const ServerCore& server() const { return *server_; }
  Micros server_clock(Micros t) const { return clock_.at(t); }
  bool server_up() const { return server_up_; }
  WorldStation& station(std::size_t k) { return *stations_[k]; }
  const WorldStation& station(std::size_t k) const { return *stations_[k]; }
  std::size_t stations() const { return stations_.size(); }

  // Faults of the server:
  void stall_server(bool stalled) { server_stalled_ = stalled; }
  void step_server_clock(Micros by) { clock_.step(by); }
  void kill_server();
  /// Starts a new process without sessions, with the body as it was (a snapshot) or at rest.
  void start_server(bool keep_body);

  /// Computes a frame; the default calls Room::run.
  std::function<FrameResult(Room&, const FrameJob&)> run_frame = [](Room& room, const FrameJob& job) { return room.run(job); };
  DatagramListener on_datagram;

  // With keys: the attacker's view.
  std::function<void(Micros, const WireEvent&)> on_wire;
  /// Called with datagrams from the server to an address that belongs to no station.
  std::function<void(const ChannelAddress&, std::span<const std::byte>)> on_stray;
  /// Delivers a datagram now, as if it came from that address.
  void inject_to_server(const ChannelAddress& from, std::span<const std::byte> bytes);
  /// Delivers a datagram now, as if it came from the server.
  void inject_to_station(std::size_t station, std::span<const std::byte> bytes);
  WorldTrust& trust() { return *trust_; }
  /// With keys: from now on the station's datagrams come from another address; datagrams to the old one are lost.
  void rebind(std::size_t station);

 private:
  struct Datagram {
    std::uint64_t number = 0;
    PeerId peer = 0;  ///< the station's end
    bool to_server = false;
    std::vector<std::byte> bytes;   ///< datagram of the session; empty: the channel's own
    std::vector<std::byte> sealed;  ///< on the wire, with keys
  };
  struct Finished {
    FrameResult result;
  };

  std::unique_ptr<ServerCore> new_server() const;
  void know_keys();
  WorldStation& add(std::unique_ptr<WorldStation> station);
  void at_moment();
  bool deliver();
  bool hand_to_server(Datagram& datagram);
  bool hand_to_station(Datagram& datagram);
  void tell(DatagramEvent::Kind kind, const Datagram& datagram) const;
  void haptic_ticks();
  void client_net();
  void server_net();
  void charge(const FrameJob& job, FrameResult& result) const;
  void send(PeerId peer, bool to_server, std::span<const std::byte> bytes, std::vector<std::byte> sealed = {});
  void send_channel(PeerId peer, bool to_server, std::vector<std::byte> sealed);
  void see_wire(PeerId peer, bool to_server, std::span<const std::byte> bytes) const;
  bool ready_to_send(std::size_t station, Micros t);
  std::vector<ChannelPeer> server_channel(Micros t);
  void send_sealed(ChannelPeer to, std::span<const std::byte> bytes, Micros t);
  void take_at_server(const Datagram& datagram);
  void open_at_server(const ChannelAddress& from, std::span<const std::byte> bytes, bool brought);
  void tell_brought(const Letter& letter, const ChannelAddress& from) const;
  void take_at_station(std::size_t station, const Datagram& datagram);
  bool is_copy(const Datagram& datagram);
  PeerId peer_of(std::size_t station);
  WorldStation& station_of(PeerId peer) { return *stations_[peers_[peer - 1]]; }
  Micros next_moment() const;
  Micros server_clock() const { return clock_.at(now_); }

  WorldOptions options_;
  Scene scene_;
  WorldClock clock_;  ///< clock of the server
  Room room_;
  std::uint64_t instance_;
  std::unique_ptr<ServerCore> server_;
  std::unique_ptr<WorldTrust> trust_;    ///< set with keys
  std::vector<std::uint8_t> delivered_;  ///< by number, with `once`
  bool server_up_ = true, server_stalled_ = false;
  std::deque<Datagram> waiting_;  ///< for a stalled server
  std::vector<std::unique_ptr<WorldStation>> stations_;
  std::vector<std::size_t> peers_;  ///< station of peer k + 1
  struct End {
    std::size_t station;
    int life;
  };
  std::map<ChannelPeer, End> ends_;  ///< sessions at this server
  DelayQueue<std::function<void()>> events_;
  DelayQueue<Datagram> in_flight_;
  DelayQueue<Finished> computing_;
  std::uint64_t datagrams_ = 0;
  Micros now_{};
  bool begun_ = false, room_started_ = false;
};

}  // namespace palpate
