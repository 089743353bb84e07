// The server's side of the sessions of one room without sockets, threads or clocks.
//
// take a datagram, tick, emit datagrams, say the deadline; and, because a frame takes long, the body's work is handed out:
// when tick() finds a frame due, next_job() gives it; the caller runs Room::run on whatever thread it likes and brings the
// result back with finish(). At most one job is out at a time. Of the frames that fall due meanwhile the last begins as soon as
// it is back, the others are skipped and counted: a frame that was once late goes less far than two, and the room catches up.
// Before the first job runs, Room::start(body_time()) is due once.
//
// Frames are due at the multiples of 1 / rate_hz from the first tick on. Whoever drives the core hands over all datagrams that
// came by a moment before it ticks at that moment.
//
// Playout: every station has a jitter buffer, the age that the newest known of its samples rarely exceeds before the next one
// comes: it grows at once when samples come later, and shrinks slowly. With one punctual station (its newest sample came within
// kLateAfter) a frame goes up to that sample: nothing is gained by waiting, and nothing is known beyond. With several it goes as
// far as all are known, but waits for nobody longer than that station's jitter buffer, nor longer than kMostWait beyond the
// quickest station's: a slow hand costs a quick one that much age and no more. A tool whose samples are not there yet goes on as
// it went for a while, and is led back to where it truly was when they come (tool_track.hpp); its patches are newer for it, which
// is worth more to the slow hand than what its tool is off by (`palpate-lab beside`). When all are late the body goes on at the
// lag of the least late one. With no haptic station the body runs on the server's clock. Body time is the server's clock; it
// never goes back, a frame that would advance it by less than kLeastFrame is skipped, one by more than kLongestFrame is cut
// there.
//
// A patch is stamped, on its way out, in the clock of the station it goes to: for a station's own samples that is the exact
// inverse of the mapping they came by (timeline.hpp). A shadow lives in the process of the station whose tool it shares and gets
// its stamps through the timeline of that station.
//
// A station whose newest sample is older at the stamp than its patch is valid for gets a beat in place of the patch: its force
// fades as if nothing came from here either, and comes back with its samples.
//
// A room in which the body sleeps (room.hpp) and nobody is has no frames: deadline() is Micros::max(), and its time stands still.
// With the first Hello it goes on as if it had never stopped: at the frame that is due next, up to which the body has slept.
//
// A station or viewer may ask for the body to be put back to rest (reset_request.hpp); the next frame that begins does so.
//
// A room that takes longer over its frames than there is time for skips some: it slows down. It says
// so in its beats (rate_hz, behind), and to stations that get patches in a beat beside them. Stamps stay those of the body.
//
// Trust: an unknown sender is answered with at most as many bytes as it sent; a new station gets nothing but Welcome until it
// has shown, by using its id, that it receives at its address.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/record/recording.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/messages.hpp"
#include "server/core/frame_costs.hpp"
#include "server/core/frame_meter.hpp"
#include "server/core/room_facts.hpp"
#include "server/core/station.hpp"
#include "server/room/deadband.hpp"
#include "server/room/room.hpp"

namespace palpate {

struct ServerOptions {
  std::uint64_t instance = 1;  ///< drawn anew by each process, for each room
  double rate_hz = 20;
  std::string room = {};   ///< its name, for stations that ask for one; empty: it has none
  std::string rooms = {};  ///< names of all rooms of the process, for a station that asks for another
  double deadband = 0;     ///< share of a force below which a change is not sent (deadband.hpp), 0 = every patch is
};

inline constexpr Micros kSilentAfter{1'000'000};  ///< another peer may take the name of a station silent for so long
inline constexpr Micros kGoneAfter{3'000'000};    ///< a station silent for so long has left
inline constexpr Micros kLateAfter{150'000};      ///< no newer sample for so long: the tool stands still
inline constexpr Micros kMostWait{20'000};        ///< that patches are older for the sake of a slower station's samples
inline constexpr Micros kSampleAhead{250'000};    ///< a sample may lie so far in the future while the clocks settle
inline constexpr Micros kLeastFrame{1'000};
inline constexpr Micros kHorizonMost{2'000'000};    ///< a station that says more is not believed
inline constexpr Micros kSilenceMost{1'000'000};    ///< patches are not valid for longer for the sake of a link that loses them
inline constexpr double kPatchesLost = 0.002;       ///< share of the patches that may get lost: else they go more than once
inline constexpr int kPatchCopiesMost = 3;          ///< datagrams that carry the same patch
inline constexpr int kLossJudged = 20;              ///< datagrams at least, before a station's word on what it loses counts
inline constexpr Micros kLinkReportEvery{250'000};  ///< Beat beside the patches, that tells how link and room do
inline constexpr Micros kLongestFrame{500'000};
inline constexpr double kSlowBelow = 0.95;  ///< of the frame rate: a room that has time for less says so to its stations

struct ServerCounts {
  std::uint64_t received = 0, bytes_received = 0, sent = 0, bytes_sent = 0;
  std::array<std::uint64_t, kWireFaults> dropped{};
  std::uint64_t unknown_station = 0;  ///< datagrams with an id that nobody here has
  std::uint64_t unexpected = 0;       ///< messages that a server does not take
  std::uint64_t joins = 0, refusals = 0, leaves = 0, timeouts = 0;
  std::uint64_t resets = 0;            ///< of the body
  std::uint64_t answers_withheld = 0;  ///< larger than the question, or too many at once
  std::uint64_t frames = 0, frames_failed = 0;
  std::uint64_t frames_busy = 0;              ///< skipped: one before was still being computed when the next fell due
  std::uint64_t frames_waiting = 0;           ///< skipped: no newer samples
  std::uint64_t frames_asleep = 0;            ///< of `frames`: the body slept and was not stepped
  std::uint64_t frames_without_rollouts = 0;  ///< of `frames`: there was no time for them
  std::uint64_t steps = 0, cut_steps = 0;
  Micros frame_time_sum{}, frame_time_max{};  ///< from next_job() to finish()
  Micros simulated{}, stepping{};             ///< by frames that stepped the body; their part of frame_time_sum

  std::uint64_t dropped_all() const;
};

/// What a room has time for.
struct Pace {
  double rate_hz = 0;  ///< frames a second, of the last second; the options' rate when none was skipped for lack of time
  Micros behind{};     ///< age of the body's newest state when it was computed
};

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

  std::optional<FrameJob> next_job(Micros now);
  void finish(FrameResult result, Micros now);
  /// Moment up to which the body was simulated. Meaningful from the first tick on.
  Micros body_time() const { return body_time_; }

  /// Hears who comes, goes and is refused, and why.
  std::function<void(const RecordedEvent&)> on_event;

  /// Hears each change of the buttons of a station's tool, once; server's clock.
  std::function<void(StationId, const ButtonChange&)> on_buttons;

  /// Hears what a station gets that left the scheme to the server: first, and at each change.
  std::function<void(const std::string& station, const SchemeInUse&)> on_scheme;

  /// Everyone is told and forgotten.
  void shut_down();
  /// All that this peer has in the room is told so, and forgotten: its key does not count any more.
  void expel(PeerId peer, Micros now);
  /// Queues an answer to someone who is not, or not any more, in the room; of at most `limit` bytes.
  void refuse(const Message& question, PeerId to, const Refuse& refusal, std::size_t limit);

  const ServerCounts& counts() const { return counts_; }
  /// Longest frame time since the last reset, for reports at intervals.
  Micros longest_frame() const { return longest_frame_; }
  void reset_longest_frame() { longest_frame_ = Micros{}; }
  std::vector<StationReport> stations() const;
  /// Of a station's tool, the newest that came; nothing where the device has none.
  Orientation orientation(StationId id) const;
  const Pace& pace() const { return pace_; }
  std::size_t station_count() const { return stations_.size(); }
  const ServerOptions& options() const { return options_; }
  const RoomFacts& facts() const { return facts_; }

 private:
  struct Reply {
    PeerId to = 0;
    Message message;  ///< a Refuse
    std::size_t limit = 0;
    Refuse& refusal() { return std::get<Refuse>(message.body); }
  };

  // sessions.cpp
  void take_hello(const Message& message, PeerId from, std::size_t size, Micros now);
  void take_samples(Station& station, const Samples& samples, Micros now);
  void take_hold(Station& station, const Samples& samples);
  void take_reset(Station& station, const Reset& reset, Micros now);
  static void take_playing(Station& station, std::uint32_t seq);
  void take_from(Station& station, const Message& message, Micros now);
  std::optional<Refuse> objection(const Hello& hello, const Station* in_place_of) const;
  void drop_silent(Micros now);
  void tell(RecordedEventKind kind, StationId id, const Hello& hello, const std::string& text, Micros now) const;
  Station* asked_before(const Hello& hello, PeerId from);
  std::string free_name(const std::string& like) const;
  Station* find(const std::string& name);
  const Station* find(const std::string& name) const;

  // frames.cpp
  bool is_idle() const { return asleep_ && !job_out_ && stations_.empty(); }
  void wake(Micros now);
  void note_due(bool skipped);
  void count(const FrameResult& result, Micros took);
  void learn_costs(const FrameResult& result);
  void choose_detail(Micros now);
  void choose_schemes(const DetailCost& cost, Micros now);
  Micros due(std::uint64_t frame) const;
  Micros playout(Micros now) const;
  FrameJob make_job(Micros target) const;
  StationJob make_station_job(const Station& station, Micros target) const;
  Micros horizon(const Station& station) const;
  Micros silence(const Station& station) const;
  int order(const Station& station, Micros horizon) const;
  Beat beat_for(const Station& station) const;
  void beat_all();
  void beat(Station& station);
  void give(Station& station, StationFrame& frame, Micros now);
  void send_patch(Station& station, StationFrame& frame);
  void let_live_on(Station& station, Micros stamp);
  bool is_lost(const Station& station, const Patch& patch) const;
  const Station* tool_of(const Station& station) const;
  void report(Station& viewer, Micros now);
  void show(const FrameResult& result, Micros now);
  Micros station_time(const Station& station, Micros server_time) const;

  // emit.cpp
  std::size_t send(const Message& message, PeerId to, std::span<std::byte> out, PeerId& whom);
  std::size_t emit_reply(std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_to(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t say(Station& station, Body body, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_welcome(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_terms(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_beat(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_patch(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_view(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  std::size_t emit_shape(Station& station, std::span<std::byte> out, PeerId& to, Micros now);
  Tools tools(const Station& viewer) const;
  RoomView room_view(Micros now) const;

  RoomFacts facts_;
  ServerOptions options_;
  std::map<StationId, Station> stations_;  ///< ordered, so that every run emits in the same order
  StationId last_id_ = 0, emit_after_ = 0;
  std::deque<Reply> replies_;
  bool started_ = false, job_out_ = false;
  bool owed_ = false;    ///< a frame fell due and has not begun
  bool asleep_ = false;  ///< the body, since the last frame
  bool reset_due_ = false;
  std::optional<FrameJob> job_;
  Micros first_tick_{}, body_time_{}, job_began_{}, compute_mean_{}, longest_frame_{};
  Micros lag_{};  ///< how old the body's state is already when its frame falls due
  std::uint64_t next_frame_ = 0;
  std::deque<std::uint8_t>
      lately_;  ///< of the frames that fell due in the last second: 1 skipped because the last one took too long
  Pace pace_;
  FrameMeter meter_;
  FrameCosts costs_;
  DetailChoice rollouts_;
  ShapeStream shapes_;
  ServerCounts counts_;
};

}  // namespace palpate
