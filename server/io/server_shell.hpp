// Drives rooms in real time: a UDP socket and a ServerCore a room on the thread that calls run(), the bodies on a pool of
// threads.
//
// The network thread sleeps until a datagram comes or the first core's deadline (for good when all rooms are idle, but for the
// recordings and who watches), takes what waits, ticks, sends. It takes at most kTakenAtOnce datagrams, and for no longer than
// kTakingMost: then frames, signals and timers have their turn, whoever sends how much. The frame job of a room goes to the pool,
// its result comes back as a task of the network thread; the two share nothing else. A room has one job out at most, and jobs are
// taken up in the order in which they were handed out: a room that overruns keeps one thread busy and skips its own frames, not
// those of others while there are as many threads as rooms that overrun, and one more. The clock is steady_clock, read when a
// datagram is taken from the socket. A body that throws ends its own room: its stations are told, and the others go on; run()
// throws it where it was the last.
//
// drain() lets nobody in any more and waits for the hands that are there to leave; stop() says goodbye to who is left, three
// times within 40 ms, as datagrams get lost, and ends.
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
#include "server/record/absent_hands.hpp"
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
  bool resume = false;    ///< where `file` is there, its series is gone on with: from the newest, into the next (record_file.hpp)
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
  using Watch = std::function<void(ServerState)>;
  static constexpr Micros kPulseEvery{500'000};

  /// InputError when `listen` is no address, the port is in use, or a recording cannot be begun or gone on from. `say` hears what
  /// happens, on the network thread.
  ServerShell(const std::vector<NamedScene>& scenes, const ShellOptions& options, SayEvent say);

  UdpEndpoint address() const { return socket_.local_endpoint(); }
  /// Until stop(). Throws what the body of the last room threw that was left.
  void run();
  /// Before run(): `watch` gets the state every kPulseEvery, on the network thread, also while all rooms are idle.
  void on_pulse(Watch watch) { watch_ = std::move(watch); }
  /// Nobody is let in any more; stop() follows when no hand is left, after `most` at the latest. From a task of context().
  void drain(Micros most);
  bool draining() const { return drain_until_.has_value(); }
  /// Stations are told; run() returns once that has gone out and the frames in hand are done. From a task of context().
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
  static constexpr Micros kReportEvery{5'000'000}, kRecordEvery{200'000}, kTakingMost{1'000}, kDrainedEvery{50'000},
      kGoodbyeEvery{20'000}, kRefusalSaidEvery{100'000};
  static constexpr int kTakenAtOnce = 256, kGoodbyes = 3;

  struct Body {
    Body(const Scene& scene, std::size_t threads);
    FrameResult run(const FrameJob& job);
    std::function<FrameResult(Room&, const FrameJob&)> simulate;
    SpinningThreadPool step_pool;
    Room room;  ///< used by the job that is out, by none other
    bool started = false, in_rollouts = false;
    Micros rollouts_began{}, rollouts_took{};  ///< of the job that is out
    ServerCounts reported;                     ///< counts at the last report
    StationLinks links;
    Micros processor_took{}, wall_took{};  ///< of the job that is out
    CoreShare share;
    bool slow = false;  ///< it was said that it cannot keep its rate
    std::optional<RoomRecording> recording;
    RoomRecorder* recorder() { return recording ? recording->recorder() : nullptr; }
    AbsentHands absent;
  };

  void hear_rooms();
  void receive();
  void take_waiting();
  void take(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void take_sealed(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now);
  void say_refused();
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
  std::vector<std::unique_ptr<Body>> bodies_;  // parallel to the rooms of cores_
  Peers peers_;
  ServerRooms cores_;
  asio::io_context io_{1};
  UdpSocket socket_;
  asio::steady_timer timer_{io_}, report_timer_{io_}, record_timer_{io_}, pulse_timer_{io_}, end_timer_{io_};
  std::array<std::byte, 2048> in_{};
  std::array<std::byte, kMaxDatagramBytes> out_{};
  std::array<std::byte, kMaxSealedBytes> sealed_{};
  std::optional<ServerTrust> trust_;
  std::optional<Sender> sender_;  ///< of the datagram that is being taken
  TrafficCounts traffic_;
  std::array<Micros, kChannelFaults> next_refusal_said_{};
  std::optional<Micros> drain_until_;
  bool reporting_ = false;  ///< report_timer_ runs
  bool ending_ = false;     ///< goodbyes go out
  std::exception_ptr failure_;
  std::size_t threads_;
  std::unique_ptr<asio::thread_pool> pool_;
};

}  // namespace palpate
