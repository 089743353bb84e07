// The server's side of the sessions of one room without sockets, threads or clocks.
//
// take a datagram, tick, emit datagrams, say the deadline; and, because a frame takes long, the body's work is handed out:
// when tick() finds a frame due, next_job() gives it; the caller runs Room::run on whatever thread it likes and brings the
// result back with finish(). Before the first job runs, Room::start(body_time()) is due once. Whoever drives the core hands over
// all datagrams that came by a moment before it ticks at that moment.
//
// It owns, and joins, what does the work on the stations of the room:
//
//     Sessions         who is there: handshake, names, seats, leaving
//     FrameScheduler   when a frame begins and what the body is given for it
//     PatchSender      what a frame's result becomes for the stations
//     ViewSender       and for the viewers
//
// A station or viewer may ask for the body to be put back to rest (reset_request.hpp); the next frame that begins does so. It may
// ask for two at once and two a minute, all of a room for four at once and six a minute: nobody takes the body out of the others'
// hands. What is too soon waits, as who asks repeats it.
// A room that takes longer over its frames than there is time for skips some: it slows down. It says so in its beats (rate_hz,
// behind), and to stations that get patches in a beat beside them. Stamps stay those of the body.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/core/frame_scheduler.hpp"
#include "server/core/patch_sender.hpp"
#include "server/core/sessions.hpp"
#include "server/core/view_sender.hpp"
#include "server/room/room.hpp"

namespace palpate {

struct DatagramCounts {
  std::uint64_t received = 0, bytes_received = 0, sent = 0, bytes_sent = 0;
  std::array<std::uint64_t, kWireFaults> dropped{};
  std::uint64_t resets_withheld = 0;                               ///< requests that came too soon after others
  std::uint64_t unexpected = 0;                                    ///< messages that a server does not take
  std::uint64_t bytes_from_strangers = 0, bytes_to_strangers = 0;  ///< from who is no station; answers to Hellos and to those

  std::uint64_t dropped_all() const;
};

struct ServerCounts : DatagramCounts, SessionCounts, FrameCounts, PatchCounts {};

class ServerCore {
 public:
  ServerCore(RoomFacts facts, const ServerOptions& options);

  void take(std::span<const std::byte> bytes, PeerId from, Micros now);
  /// What decode() made of `size` bytes.
  void take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  void tick(Micros now);
  /// Bytes of the next datagram written into `out` and whom it is for, 0 when there is none. Call until 0.
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  /// When tick() is due at the latest; Micros::max() when only a datagram can make it so.
  Micros deadline() const;

  std::optional<FrameJob> next_job(Micros now) { return frames_.next_job(now); }
  void finish(FrameResult result, Micros now);
  /// Moment up to which the body was simulated. Meaningful from the first tick on.
  Micros body_time() const { return frames_.body_time(); }

  /// Hears who comes, goes and is refused, and why.
  void on_event(std::function<void(const RecordedEvent&)> listener) { sessions_.on_event = std::move(listener); }
  /// Hears each change of the buttons of a station's tool, once; server's clock.
  void on_buttons(std::function<void(StationId, const ButtonChange&)> listener) { on_buttons_ = std::move(listener); }
  /// Hears what a station gets that left the scheme to the server: first, and at each change.
  void on_scheme(std::function<void(const std::string& station, const SchemeInUse&)> listener) {
    frames_.detail().on_scheme = std::move(listener);
  }

  /// Hears whose tool was let go of, as it cost more than hands do.
  void on_let_go(std::function<void(const Station&)> listener) { on_let_go_ = std::move(listener); }

  /// Whether two senders have one key and the first is the newer session: a station gives its name to its successor.
  void know_successors(std::function<bool(PeerId, PeerId)> succeeds) { sessions_.succeeds = std::move(succeeds); }

  /// Nobody is let in any more; who is there stays.
  void drain() { sessions_.drain(kShuttingDown); }
  bool draining() const { return sessions_.draining(); }
  /// Everyone is told and forgotten.
  void shut_down(Micros now) { close(kShuttingDown, false, now); }
  /// Those whom shut_down() told are told again, as the first may have been lost.
  void repeat_goodbyes(Micros now) { sessions_.repeat_goodbyes(now); }
  /// All that this peer has in the room is told so, and forgotten: its key does not count any more.
  void expel(PeerId peer, Micros now) { sessions_.expel(peer, now); }
  /// Queues an answer to someone who is not, or not any more, in the room; of at most `limit` bytes.
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now) {
    sessions_.refuse(question, to, refusal, limit, now);
  }
  /// The body cannot go on: everyone is told why and forgotten, who comes is refused with that, and no frame begins any more.
  void end(const std::string& why, Micros now) { close(why, true, now); }
  bool ended() const { return frames_.ended(); }
  /// When the frame that is being computed began; nothing while there is none.
  std::optional<Micros> computing_since() const { return frames_.computing_since(); }
  /// Whether it is for a station of this room, or for one that is about to be.
  bool knows(const Message& message, PeerId from, Micros now) const { return sessions_.knows(message, from, now); }
  /// Whether a station of this room is there.
  bool serves(PeerId peer) const { return sessions_.serves(peer); }

  ServerCounts counts() const { return {counts_, sessions_.counts(), frames_.counts(), patches_.counts()}; }
  /// Longest frame time since the last reset, for reports at intervals.
  Micros longest_frame() const { return frames_.longest_frame(); }
  void reset_longest_frame() { frames_.reset_longest_frame(); }
  std::vector<StationReport> stations() const;
  /// Of a station's tool, the newest that came; nothing where the device has none.
  Orientation orientation(StationId id) const;
  const Pace& pace() const { return frames_.pace(); }
  std::size_t station_count() const { return sessions_.stations().size(); }
  /// Whether anybody feels the body: viewers aside.
  bool has_hands() const;
  const ServerOptions& options() const { return options_; }
  const RoomFacts& facts() const { return views_.facts(); }

 private:
  static constexpr const char* kShuttingDown = "the server is shutting down";

  /// False for a message that a server does not take from such a station.
  bool take_from(Station& station, const Body& body, Micros now);
  void close(const std::string& why, bool ended, Micros now);
  void take_samples(Station& station, const Samples& samples, Micros now);
  void take_reset(Station& station, const Reset& reset, Micros now);
  std::size_t emit_to_next(std::span<std::byte> out, PeerId& to, Micros now);

  ServerOptions options_;
  Sessions sessions_;
  FrameScheduler frames_;
  PatchSender patches_;
  ViewSender views_;
  RateLimit resets_{4, Micros{10'000'000}};
  StationId emit_after_ = 0;
  DatagramCounts counts_;
  std::function<void(StationId, const ButtonChange&)> on_buttons_;
  std::function<void(const Station&)> on_let_go_;
};

}  // namespace palpate
