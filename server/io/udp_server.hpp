// Drives rooms in real time: a UDP socket and one ServerCore per room on the thread that calls run(), the bodies on a thread
// pool.
//
// The network thread sleeps until a datagram comes or a core's deadline passes (indefinitely if all rooms are idle, except for
// recordings and watches), receives the waiting datagrams, ticks and sends. It receives at most kTakenAtOnce datagrams at once
// and for at most kTakingMost, so that no sender delays frames, signals and timers. The frame job of a room goes to the pool, and
// its result returns as a task of the network thread; the two threads share nothing else. A room has at most one job out, and
// jobs start in the order in which they were handed out. A room that overruns keeps one thread busy and skips its own frames, but
// not those of others as long as there is one thread more than rooms that overrun. The clock is steady_clock, read when a
// datagram is taken from the socket. A body that throws ends its own room: its stations are informed, and the other rooms
// continue; if it was the last room, run() throws the exception.
//
// drain() refuses new sessions and waits for the present hands to leave. stop() sends the remaining stations goodbye, three times
// within 40 ms, as datagrams get lost, and ends.
//
// With keys every datagram passes through the trust channel (server_trust.hpp) on the network thread; bodies and frames are
// unaware of it.
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <asio/thread_pool.hpp>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/io/endpoint.hpp"
#include "common/io/spinning_thread_pool.hpp"
#include "server/core/server_rooms.hpp"
#include "server/io/core_share.hpp"
#include "server/io/peers.hpp"
#include "server/io/room_recording.hpp"
#include "server/io/server_event.hpp"
#include "server/io/server_state.hpp"
#include "server/record/reserved_tools.hpp"
#include "server/room/room.hpp"
#include "server/trust/server_trust.hpp"

namespace palpate {

struct FrameCost;

/// A scene and the name by which stations ask for its room.
struct NamedScene {
  std::string name;
  Scene scene;
  std::string file = {}, text = {};  ///< for a recording: the scene's file and its text with all defaults
};

/// Throws InputError, with `where`, for a name that a room beside these cannot have.
void check_room_name(const std::string& where, const std::string& name, const std::vector<NamedScene>& others);

struct RecordOptions {
  std::string file;       ///< empty: none; with several rooms each gets its own, named_after() the room
  double shapes_hz = 10;  ///< surface shapes per second [Hz], 0: none
  bool resume = false;    ///< true: an existing series of `file` is resumed from its newest file into the next (record_file.hpp)
  std::string program;    ///< name and version of the program
};

struct ShellOptions {
  std::string listen;  ///< HOST:PORT
  double rate_hz = 20;
  std::size_t threads =
      1;  ///< threads that step bodies: a pool of at most one per room; each room's share of the others helps with its body
  RecordOptions record = {};
  double deadband = 0;                                               ///< see ServerOptions
  std::optional<SiteKeys> keys = {};                                 ///< none: anybody who reaches the port may touch
  std::function<FrameResult(Room&, const FrameJob&)> simulate = {};  ///< replaces Room::simulate() in tests that break it
};

class UdpServer {
 public:
  using Watch = std::function<void(ServerState)>;
  static constexpr Micros kPulseEvery{500'000};

  /// Throws InputError if `listen` is no address, the port is in use, or a recording cannot be begun or resumed. `say` is called
  /// with events, on the network thread.
  UdpServer(const std::vector<NamedScene>& scenes, const ShellOptions& options, SayEvent say);

  UdpEndpoint address() const { return socket_.local_endpoint(); }
  /// Runs until stop(). Throws the exception of the last remaining room's body.
  void run();
  /// Sets `watch`, called with the state every kPulseEvery on the network thread, also while all rooms are idle. Call before
  /// run().
  void on_pulse(Watch watch) { watch_ = std::move(watch); }
  /// Sets the cost of a room's frames that holds until frames have been measured. Call before run().
  void expect_costs(std::size_t room, const FrameCost& cost);
  /// Refuses new sessions; stop() follows when no hand is left, after `most` at the latest. Call from a task of context().
  void drain(Micros most);
  bool draining() const { return drain_until_.has_value(); }
  /// Says goodbye to the stations; run() returns once that is sent and the running frames are done. Call from a task of
  /// context().
  void stop();
  /// Replaces the keys; sessions whose key is missing now, or has other rights, end. Call from a task of context().
  void change_keys(SiteKeys keys);
  /// Executor for signals and timers of the caller.
  asio::io_context& context() { return io_; }
  const ServerRooms& rooms() const { return cores_; }
  /// Returns the integrator of a room's body, with the reason for it.
  const std::string& integrator(std::size_t room) const { return workers_[room]->room.integrator(); }
  /// Returns a line per room with totals since the start.
  std::vector<std::string> summary() const;

 private:
  static constexpr Micros kReportEvery{5'000'000}, kRecordEvery{200'000}, kTakingMost{1'000}, kDrainedEvery{50'000},
      kGoodbyeEvery{20'000}, kRefusalSaidEvery{100'000};
  static constexpr int kTakenAtOnce = 256, kGoodbyes = 3;

  struct RoomWorker {
    RoomWorker(const Scene& scene, std::size_t threads);
    FrameResult run(const FrameJob& job);
    std::function<FrameResult(Room&, const FrameJob&)> simulate;
    SpinningThreadPool step_pool;
    Room room;  ///< used only by the job that is out
    bool started = false, in_rollouts = false;
    Micros rollouts_began{}, rollouts_took{};  ///< for the job that is out
    ServerCounts reported;                     ///< counts at the last report
    StationLinks links;
    Micros processor_took{}, wall_took{};  ///< for the job that is out
    CoreShare share;
    bool slow = false;  ///< true after it was reported that the room cannot keep its rate
    std::optional<RoomRecording> recording;
    RoomRecorder* recorder() { return recording ? recording->recorder() : nullptr; }
    ReservedTools absent;
  };

  void hear_rooms();
  void receive();
  void take_waiting();
  void take(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void take_sealed(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void say_refused();
  bool may_say(ChannelFault fault, Micros now);
  void say_no_key(const std::string& station, const UdpEndpoint& from, Micros now);
  void say_no_right(const Letter& letter);
  void refuse_without_key(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void end_sessions(Micros now);
  void step();
  void send_all(Micros now);
  void send(std::span<const std::byte> datagram, const UdpEndpoint& to);
  void send_sealed(std::span<const std::byte> datagram, PeerId to, Micros now);
  void say_goodbyes(int left);
  void await_drained();
  void pulse();
  ServerState state(Micros now) const;
  void say(std::string kind, const std::string& text, std::vector<EventField> fields = {},
           EventLevel level = EventLevel::info) const;
  void say(std::size_t room, std::string kind, const std::string& text, std::vector<EventField> fields = {},
           EventLevel level = EventLevel::info) const;
  void say(std::size_t room, const RecordedEvent& event) const;
  void say(std::size_t room, const GuidanceNews& news) const;
  void say(std::size_t room, const SutureNews& news) const;
  RecordedEvent attributed(RecordedEvent event) const;
  std::vector<EventField> sender_fields() const;
  void watch_pace(std::size_t k);
  void hand_out(std::size_t k, FrameJob job);
  void finish(std::size_t k, FrameResult result);
  void end_room(std::size_t k, const std::exception_ptr& failure);
  void report();
  void begin_recording(const std::vector<NamedScene>& scenes, const ShellOptions& options);
  void resume(std::size_t k, const NamedScene& named, const std::vector<std::filesystem::path>& newest_first);
  void record();
  void end_recording();
  void say_recording_failed(std::size_t room, const std::string& fault) const;
  std::string label(std::size_t k) const;
  std::string pace_text(std::size_t k) const;

  struct Sender {
    UdpEndpoint from;
    std::optional<PublicKey> key = {};
  };

  SayEvent say_;
  Watch watch_;
  std::vector<std::unique_ptr<RoomWorker>> workers_;  // parallel to the rooms of cores_
  Peers peers_;
  ServerRooms cores_;
  asio::io_context io_{1};
  UdpSocket socket_;
  asio::steady_timer timer_{io_}, report_timer_{io_}, record_timer_{io_}, pulse_timer_{io_}, end_timer_{io_};
  std::array<std::byte, 2048> in_{};
  std::array<std::byte, kMaxDatagramBytes> out_{};
  std::array<std::byte, kMaxSealedBytes> sealed_{};
  std::optional<ServerTrust> trust_;
  std::optional<Sender> sender_;  ///< sender of the datagram that is being processed
  TrafficCounts traffic_;
  std::array<Micros, kChannelFaults> next_refusal_said_{};
  std::optional<Micros> drain_until_;
  bool reporting_ = false;  ///< true while report_timer_ runs
  bool ending_ = false;     ///< true while goodbyes are being sent
  std::exception_ptr failure_;
  std::size_t threads_;
  std::unique_ptr<asio::thread_pool> pool_;
};

}  // namespace palpate
