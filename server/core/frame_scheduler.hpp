// When a frame begins, and what the body is given for it.
//
// Frames are due at the multiples of 1 / rate_hz from the first tick on; because one takes long its work is handed out: tick()
// finds that a frame is due, next_job() gives it, finish() brings its result back. At most one job is out at a time. Of the
// frames that fall due meanwhile the last begins as soon as it is back, the others are skipped and counted: a frame that was once
// late goes less far than two, and the room catches up. One that is kBehindMost behind leaves out what it cannot make up for:
// nothing moves in between, and the next frame is one of kLongestFrame up to now. Before the first job runs,
// Room::start(body_time()) is due once.
//
// Body time is the server's clock. A frame takes it as far as the tools are known (playout.hpp); it never goes back, a frame that
// would advance it by less than kLeastFrame is skipped. A tool whose samples are not there yet goes on as it went for a while,
// and is led back to where it truly was when they come (tool_track.hpp); its patches are newer for it, which is worth more to a
// slow hand than what its tool is off by (`palpate-lab beside`).
//
// A patch is made for the age that it will reach before the next one takes over,
//
//     horizon = max( as the station measures it,  max(rtt, lag + rtt / 2) + mean computing time + 1 / rate_hz )  <= kHorizonMost
//
// with lag the age of the body's state in this frame: so it is known before the station has said anything, and at once when the
// body lags behind for another's samples. It is valid for as long as the link may be silent beside that: half as long again as
// from the last patch before the longest run of losses to the first behind it, since a force that is cut and comes back is worse
// to feel than one of an old patch.
//
// A room in which the body sleeps (room.hpp) and nobody is has no frames: its time stands still. With the first station it goes
// on as if it had never stopped: at the frame that is due next, up to which the body has slept.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "server/core/bin_counts.hpp"
#include "server/core/frame_detail.hpp"
#include "server/core/frame_meter.hpp"
#include "server/core/playout.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"
#include "server/room/room.hpp"

namespace palpate {

inline constexpr Micros kLeastFrame{1'000};
inline constexpr Micros kHorizonMost{2'000'000};  ///< a station that says more is not believed
inline constexpr Micros kBehindMost{1'000'000};   ///< further behind body time is left out
inline constexpr Micros kSilenceMost{1'000'000};  ///< patches are not valid for longer for the sake of a link that loses them

struct FrameCounts {
  std::uint64_t resets = 0;  ///< of the body
  std::uint64_t frames = 0, frames_failed = 0;
  std::uint64_t frames_busy = 0;              ///< skipped: one before was still being computed when the next fell due
  std::uint64_t frames_waiting = 0;           ///< skipped: no newer samples
  std::uint64_t frames_asleep = 0;            ///< of `frames`: the body slept and was not stepped
  std::uint64_t frames_without_rollouts = 0;  ///< of `frames`: there was no time for them
  std::uint64_t steps = 0, cut_steps = 0;
  std::uint64_t tools_let_go = 0;             ///< as they cost more than hands do
  Micros left_out{};                          ///< of body time: the room was too far behind
  Micros frame_time_sum{}, frame_time_max{};  ///< from next_job() to finish()
  Micros simulated{}, stepping{};             ///< by frames that stepped the body; their part of frame_time_sum
  BinCounts frame_seconds{kSecondsEdges};     ///< of `frames`: from next_job() to finish()
  BinCounts patches_seconds{kSecondsEdges};   ///< of those in which somebody got a patch: what building them took
};

/// What a room has time for.
struct Pace {
  double rate_hz = 0;  ///< frames a second, of the last second; the options' rate when none was skipped for lack of time
  Micros behind{};     ///< age of the body's newest state when it was computed
};

/// What stations and viewers are told of the body.
struct BodyNow {
  Micros time{};
  Pace pace;
  std::uint16_t resets = 0;
  bool asleep = false;
  FrameMeter::Figures lately;
};

class FrameScheduler {
 public:
  FrameScheduler(ContactKind contact, const ServerOptions& options);

  /// False where a frame is due that does not begin now: one is still being computed, or there are no newer samples.
  [[nodiscard]] bool tick(Stations& stations, Micros now);
  /// Somebody came to a room where nobody was.
  void wake(Micros now);
  /// When tick() is due at the latest; Micros::max() when only somebody who comes can make it so.
  Micros deadline(const Stations& stations) const;
  std::optional<FrameJob> next_job(Micros now);
  void finish(const FrameResult& result, Stations& stations, Micros now);

  /// Whether who knows of so many resets asks for another one; who knows of another number asked for what is done.
  bool is_new_reset(std::uint16_t resets) const { return resets == static_cast<std::uint16_t>(counts_.resets); }
  /// The body is put back to rest with the next frame.
  void reset();
  /// The frame that has not begun is not wanted any more; `ended`: nor any other.
  void drop_job(bool ended);
  bool ended() const { return ended_; }
  /// When the frame that is being computed began; nothing while there is none.
  std::optional<Micros> computing_since() const { return job_out_ ? std::optional(job_began_) : std::nullopt; }

  Micros body_time() const { return body_time_; }
  BodyNow body(Micros now) const;
  Micros horizon(const Station& station) const;
  const Pace& pace() const { return pace_; }
  const FrameCounts& counts() const { return counts_; }
  FrameDetail& detail() { return detail_; }
  /// Longest frame time since the last reset, for reports at intervals.
  Micros longest_frame() const { return longest_frame_; }
  void reset_longest_frame() { longest_frame_ = Micros{}; }

 private:
  bool is_idle(const Stations& stations) const { return ended_ || (asleep_ && !job_out_ && stations.empty()); }
  Micros due(std::uint64_t frame) const;
  void leave_out_lag(Micros known);
  void note_due(bool skipped);
  void count(const FrameResult& result, const Stations& stations, Micros took);
  FrameJob make_job(const Stations& stations, Micros target) const;
  StationJob make_station_job(const Stations& stations, const Station& station, Micros target) const;
  Micros silence(const Station& station) const;
  int order(const Station& station, Micros horizon) const;

  ContactKind contact_;
  double rate_hz_, deadband_;
  bool started_ = false, job_out_ = false, ended_ = false;
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
  FrameDetail detail_;
  FrameCounts counts_;
};

}  // namespace palpate
