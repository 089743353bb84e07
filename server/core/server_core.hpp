// The server's side of one room's sessions, without sockets, threads or clocks.
//
// The caller passes datagrams in, calls tick(), sends the datagrams of emit() and observes the deadline. A frame takes long, so
// the body's work is handed out: when tick() finds a frame due, next_job() returns it; the caller runs Room::run on any thread
// and returns the result with finish(). Room::start(body_time()) must be called once before the first job runs. All datagrams
// that arrived by a moment must be passed in before the tick of that moment.
//
// It owns and connects the parts that work on the room's stations:
//
//     Sessions         handshake, names, seats, leaving
//     FrameScheduler   when a frame begins and which inputs the body gets
//     PatchSender      messages for the stations from a frame's result
//     ViewSender       messages for the viewers
//     GuidanceRelay    messages for stations of which one guides the other
//
// A viewer may write notes for the recording: eight at once and then one every two seconds, a room 32 and then one a second. One
// that comes too soon has to wait; the viewer repeats it until a beat has its number. Where nothing is recorded it is refused.
// A station or viewer may ask for a reset of the body to rest (reset_request.hpp); the next frame that begins performs it. One
// station may reset twice at once and then twice a minute, a room four times at once and then six times a minute, so that nobody
// takes the body out of the others' hands. A request that comes too soon has to wait; the requester repeats it.
// A room whose frames take longer than their period skips some and so slows down. It reports this in its beats (rate_hz, behind),
// which stations with patches get in addition. Stamps remain those of the body.
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
#include "server/core/guidance_relay.hpp"
#include "server/core/patch_sender.hpp"
#include "server/core/sessions.hpp"
#include "server/core/view_sender.hpp"
#include "server/room/room.hpp"

namespace palpate {

struct DatagramCounts {
  std::uint64_t received = 0, bytes_received = 0, sent = 0, bytes_sent = 0;
  std::array<std::uint64_t, kWireFaults> dropped{};
  std::uint64_t resets_withheld = 0;                               ///< reset requests that came too soon after others
  std::uint64_t notes = 0, notes_withheld = 0;                     ///< notes recorded; those that came too soon after others
  std::uint64_t unexpected = 0;                                    ///< messages of a kind that a server does not accept
  std::uint64_t bytes_from_strangers = 0, bytes_to_strangers = 0;  ///< from senders without a station; answers to them

  std::uint64_t dropped_all() const;
};

struct ServerCounts : DatagramCounts, SessionCounts, FrameCounts, PatchCounts {};

class ServerCore {
 public:
  ServerCore(RoomInfo facts, const ServerOptions& options);

  void take(std::span<const std::byte> bytes, PeerId from, Micros now);
  /// Accepts the result of decode() on `size` bytes.
  void take(WireFault fault, const Message& message, std::size_t size, PeerId from, Micros now);
  void tick(Micros now);
  /// Writes the next datagram into `out` and its receiver into `to`; returns its bytes, 0 if there is none. Call until it returns
  /// 0.
  std::size_t emit(std::span<std::byte> out, PeerId& to, Micros now);
  /// Latest moment for the next tick(); Micros::max() if only a datagram can make it due.
  Micros deadline() const;

  std::optional<FrameJob> next_job(Micros now) { return frames_.next_job(now); }
  void finish(FrameResult result, Micros now);
  /// Moment up to which the body was simulated. Meaningful from the first tick on.
  Micros body_time() const { return frames_.body_time(); }

  /// Sets a listener for joins, leaves and refusals, with their reasons.
  void on_event(std::function<void(const RecordedEvent&)> listener) { sessions_.on_event = std::move(listener); }
  /// Sets a listener for each change of the buttons of a station's tool, called once per change; server clock.
  void on_buttons(std::function<void(StationId, const ButtonChange&)> listener) { on_buttons_ = std::move(listener); }
  /// Sets a listener for notes of viewers, which returns false when the room is not being recorded.
  void on_note(std::function<bool(const RecordedNote&)> listener) { on_note_ = std::move(listener); }
  /// Sets a listener for the scheme of a station that left it to the server: called at the start and at each change.
  void on_scheme(std::function<void(const std::string& station, const SchemeInUse&)> listener) {
    frames_.detail().on_scheme = std::move(listener);
  }

  /// Sets a listener for the begin and end of guidance.
  void on_guidance(std::function<void(const GuidanceNews&)> listener) { guidance_.on_guidance = std::move(listener); }

  /// Sets the costs of frames that hold until frames have been measured.
  void expect_costs(const FrameCosts::Expected& costs) { frames_.detail().expect(costs); }
  /// Sets whether the machine gives the room too little of a core, as reported to viewers.
  void set_starved(bool starved) { views_.set_starved(starved); }
  /// Sets a listener for pieces that blades cut off, with the number of their cells.
  void on_piece_removed(std::function<void(std::size_t)> listener) { on_piece_removed_ = std::move(listener); }
  /// Sets a listener for frames in which threads were tied, were cut, or cut through the tissue.
  void on_sutures(std::function<void(const SutureNews&)> listener) { on_sutures_ = std::move(listener); }
  /// Sets a listener for tools that were released because their cost was far above that of a hand.
  void on_tool_released(std::function<void(const Station&)> listener) { on_tool_released_ = std::move(listener); }

  /// Sets the key of a sender, empty for one that has left. A station hands its name to a newer session of its key, and sessions
  /// of one key have one limit of their resets.
  void know_keys(std::function<std::string(PeerId)> key_of) { sessions_.key_of = std::move(key_of); }

  /// Refuses new sessions; existing ones stay.
  void drain() { sessions_.drain(kShuttingDown); }
  bool draining() const { return sessions_.draining(); }
  /// Says goodbye to all stations and removes them.
  void shut_down(Micros now) { close(kShuttingDown, false, now); }
  /// Repeats the goodbyes of shut_down(), as the first may have been lost.
  void repeat_goodbyes(Micros now) { sessions_.repeat_goodbyes(now); }
  /// Says goodbye to all stations of this peer in the room and removes them: its key is no longer valid.
  void expel(PeerId peer, Micros now) { sessions_.expel(peer, now); }
  /// Queues an answer of at most `limit` bytes to a sender that is not, or no longer, in the room.
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit, Micros now) {
    sessions_.refuse(question, to, refusal, limit, now);
  }
  /// Ends the room, as the body cannot continue: all stations get the reason and are removed, new ones are refused with it, and
  /// no frame begins any more.
  void end(const std::string& why, Micros now) { close(why, true, now); }
  bool ended() const { return frames_.ended(); }
  /// Start of the frame that is being computed; empty if there is none.
  std::optional<Micros> computing_since() const { return frames_.computing_since(); }
  /// Returns true if the message is for a station of this room, or for one that is about to join.
  bool knows(const Message& message, PeerId from, Micros now) const { return sessions_.knows(message, from, now); }
  /// Returns true if a station of this room is at this peer.
  bool serves(PeerId peer) const { return sessions_.serves(peer); }

  ServerCounts counts() const { return {counts_, sessions_.counts(), frames_.counts(), patches_.counts()}; }
  /// Longest frame time since the last reset_longest_frame(), for periodic reports.
  Micros longest_frame() const { return frames_.longest_frame(); }
  void reset_longest_frame() { frames_.reset_longest_frame(); }
  std::vector<StationReport> stations() const;
  /// Newest orientation of a station's tool; empty if the device has none.
  Orientation orientation(StationId id) const;
  const Pace& pace() const { return frames_.pace(); }
  std::size_t station_count() const { return sessions_.stations().size(); }
  /// Returns true if a station other than a viewer is in the room.
  bool has_hands() const;
  const ServerOptions& options() const { return options_; }
  const RoomInfo& facts() const { return views_.facts(); }

 private:
  static constexpr const char* kShuttingDown = "the server is shutting down";

  /// Returns false for a message that a server does not accept from such a station.
  bool take_from(Station& station, const Message& message, Micros now);
  void close(const std::string& why, bool ended, Micros now);
  void take_beat(Station& station, const Beat& beat, Micros now);
  void take_samples(Station& station, const Samples& samples, Micros now);
  void take_reset(Station& station, const Reset& reset, Micros now);
  /// Records a note, or refuses it. `question`: the message that has it.
  void take_note(Station& station, const Note& note, const Message& question, Micros now);
  std::size_t emit_to_next(std::span<std::byte> out, PeerId& to, Micros now);

  ServerOptions options_;
  Sessions sessions_;
  FrameScheduler frames_;
  PatchSender patches_;
  ViewSender views_;
  GuidanceRelay guidance_;
  RateLimit resets_{4, Micros{10'000'000}}, notes_{32, Micros{1'000'000}};
  std::map<std::string, RateLimit> resets_of_keys_;  // of those that have reset the body lately
  StationId emit_after_ = 0;
  DatagramCounts counts_;
  std::function<void(StationId, const ButtonChange&)> on_buttons_;
  std::function<void(const Station&)> on_tool_released_;
  std::function<void(std::size_t)> on_piece_removed_;
  std::function<void(const SutureNews&)> on_sutures_;
  std::function<bool(const RecordedNote&)> on_note_;
};

}  // namespace palpate
