// Drives rooms in real time: a UDP socket and a ServerCore a room on the thread that calls run(), the bodies on a pool of
// threads.
//
// The network thread sleeps until a datagram comes or the first core's deadline (for good when all rooms are idle, but for the
// recordings), takes what waits, ticks, sends. It takes at most kTakenAtOnce datagrams, and for no longer than kTakingMost: then
// frames, signals and timers have their turn, whoever sends how much. The frame job of a room goes to the pool, its result comes
// back as a task of the network thread; the two share nothing else. A room has one job out at most, and jobs are taken up in the
// order in which they were handed out: a room that overruns keeps one thread busy and skips its own frames, not those of others
// while there are as many threads as rooms that overrun, and one more. The clock is steady_clock, read when a datagram is taken
// from the socket. A body that throws ends its own room: its stations are told, and the others go on; run() throws it where it
// was the last.
//
// With keys every datagram goes through the trust channel (server_trust.hpp) on the network thread: bodies and frames know
// nothing of it.
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <asio/thread_pool.hpp>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/io/endpoint.hpp"
#include "common/io/record_file.hpp"
#include "common/io/spinning_thread_pool.hpp"
#include "server/core/server_rooms.hpp"
#include "server/io/peers.hpp"
#include "server/record/room_recorder.hpp"
#include "server/room/room.hpp"
#include "server/trust/server_trust.hpp"

namespace palpate {

/// A scene and the name by which stations ask for its room.
struct NamedScene {
  std::string name;
  Scene scene;
  std::string file = {}, text = {};  ///< for a recording: where it comes from, and itself with all defaults
};

struct RecordOptions {
  std::string file;       ///< empty: none; of several rooms each gets its own, named_after() the room
  double shapes_hz = 10;  ///< 0: none
  std::string program;    ///< and its version
};

struct ShellOptions {
  std::string listen;  ///< HOST:PORT
  double rate_hz = 20;
  std::size_t threads =
      1;  ///< that move bodies: a pool of one a room at most; each room's share of more than that helps with its body
  RecordOptions record = {};
  double deadband = 0;                                               ///< of ServerOptions
  std::optional<SiteKeys> keys = {};                                 ///< none: whoever reaches the port may touch
  std::function<FrameResult(Room&, const FrameJob&)> simulate = {};  ///< in place of Room::simulate(), to break it
};

class ServerShell {
 public:
  using Say = std::function<void(const std::string&)>;

  /// InputError when `listen` is no address, the port is in use, or a recording cannot be begun. `say` gets lines for a person.
  ServerShell(const std::vector<NamedScene>& scenes, const ShellOptions& options, Say say);

  UdpEndpoint address() const { return socket_.local_endpoint(); }
  /// Until stop(). Throws what the body of the last room threw that was left.
  void run();
  /// Stations are told; run() returns once the frames in hand are done. From a task of context().
  void stop();
  /// From a task of context(): sessions whose key is not there any more, or has other rights, end now.
  void change_keys(SiteKeys keys);
  /// For signals and timers beside ours.
  asio::io_context& context() { return io_; }
  const ServerRooms& rooms() const { return cores_; }
  /// What moves the body of a room, and why.
  const std::string& integrator(std::size_t room) const { return bodies_[room]->room.integrator(); }
  /// A line a room about everything since the start.
  std::vector<std::string> summary() const;

 private:
  static constexpr Micros kReportEvery{5'000'000}, kRecordEvery{200'000}, kTakingMost{1'000}, kRefusedLineEvery{1'000'000};
  static constexpr int kTakenAtOnce = 256;

  struct Body {
    Body(const Scene& scene, std::size_t threads);
    FrameResult run(const FrameJob& job);
    std::function<FrameResult(Room&, const FrameJob&)> simulate;
    SpinningThreadPool step_pool;
    Room room;  ///< used by the job that is out, by none other
    bool started = false, in_rollouts = false;
    Micros rollouts_began{}, rollouts_took{};  ///< of the job that is out
    ServerCounts reported;                     ///< counts at the last report
    std::unique_ptr<RoomRecorder> recorder;
    std::unique_ptr<RecordFile> file;
  };

  void receive();
  void take_waiting();
  void take(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void take_sealed(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void say_refused(Micros now);
  void end_sessions(Micros now);
  void step();
  void send_all(Micros now);
  void send(std::span<const std::byte> datagram, const UdpEndpoint& to);
  void send_sealed(std::span<const std::byte> datagram, PeerId to, Micros now);
  void hand_out(std::size_t k, FrameJob job);
  void end_room(std::size_t k, const std::exception_ptr& failure);
  void report();
  void begin_recording(const std::vector<NamedScene>& scenes, const ShellOptions& options);
  void record();
  void end_recording();
  std::string label(std::size_t k) const;

  Say say_;
  std::vector<std::unique_ptr<Body>> bodies_;  // parallel to the rooms of cores_
  Peers peers_;
  ServerRooms cores_;
  asio::io_context io_{1};
  UdpSocket socket_;
  asio::steady_timer timer_{io_}, report_timer_{io_}, record_timer_{io_};
  std::array<std::byte, 2048> in_{};
  std::array<std::byte, kMaxDatagramBytes> out_{};
  std::array<std::byte, kMaxSealedBytes> sealed_{};
  std::optional<ServerTrust> trust_;
  Micros next_refused_line_{};
  std::uint64_t send_failed_ = 0;
  bool reporting_ = false;  ///< report_timer_ runs
  std::exception_ptr failure_;
  std::size_t threads_;
  std::unique_ptr<asio::thread_pool> pool_;
};

}  // namespace palpate
