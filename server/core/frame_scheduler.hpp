// Decides when a frame begins and which inputs the body gets for it.
//
// Frames are due at multiples of 1 / rate_hz from the first tick on. A frame takes long, so its work is handed out: tick()
// notices that a frame is due, next_job() returns the work, finish() accepts the result. At most one job is out at a time. Of the
// frames that fall due meanwhile, the last begins as soon as the job is back; the others are skipped and counted. A frame
// that begins late covers less than two periods, so the room catches up. A room that is more than kBehindMost behind drops the
// body time that it cannot make up for: nothing moves during that time, and the next frame spans kLongestFrame up to now.
// Room::start(body_time()) must be called once before the first job runs.
//
// Body time is the server's clock. A frame advances it as far as the tools are known (playout.hpp); it never goes back, and a
// frame that would advance it by less than kLeastFrame is skipped. A tool whose samples are late is extrapolated for a while and
// led back to its true path when they come (tool_track.hpp). Its patches are newer this way, which gains a slow hand more
// accuracy than the extrapolation error costs (docs/results/masking.md).
//
// A patch is made for the age that it will reach before the next one takes over,
//
//     horizon = max( as the station measures it,  max(rtt, lag + rtt / 2) + mean computing time + 1 / rate_hz )  <= kHorizonMost
//
// where lag is the age of the body's state in this frame. So the horizon is known before the station reports anything, and grows
// at once when the body lags because another station's samples are late. Beyond the horizon a patch stays valid for the longest
// silence that the link may cause: one and a half times the span from the last patch before the longest run of losses to the
// first one after it, as a force that is cut and returns feels worse than the force of an old patch.
//
// A room whose body sleeps (room.hpp) and that has no station runs no frames: its time stands still. When a station joins, it
// continues as if it had never stopped, with the next due frame, up to which the body has slept.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "server/core/bin_counts.hpp"
#include "server/core/frame_budget.hpp"
#include "server/core/frame_meter.hpp"
#include "server/core/playout.hpp"
#include "server/core/server_options.hpp"
#include "server/core/station.hpp"
#include "server/room/room.hpp"

namespace palpate {

inline constexpr Micros kLeastFrame{1'000};
inline constexpr Micros kHorizonMost{2'000'000};  ///< a larger horizon reported by a station is clamped
inline constexpr Micros kBehindMost{1'000'000};   ///< body time is dropped beyond this lag
inline constexpr Micros kSilenceMost{1'000'000};  ///< a lossy link extends the validity of a patch by at most this

struct FrameCounts {
  std::uint64_t resets = 0;  ///< resets of the body
  std::uint64_t frames = 0, frames_failed = 0;
  std::uint64_t frames_busy = 0;              ///< skipped: the frame before was still being computed
  std::uint64_t frames_waiting = 0;           ///< skipped: no newer samples
  std::uint64_t frames_asleep = 0;            ///< those of `frames` in which the body slept and was not stepped
  std::uint64_t frames_without_rollouts = 0;  ///< those of `frames` without time for rollouts
  std::uint64_t steps = 0, cut_steps = 0;
  std::uint64_t tools_released = 0;           ///< tools released because their cost was far above that of a hand
  std::uint64_t bites_torn_out = 0;           ///< bites of threads that left the body
  Micros left_out{};                          ///< body time dropped because the room was too far behind
  Micros frame_time_sum{}, frame_time_max{};  ///< from next_job() to finish()
  Micros simulated{}, stepping{};  ///< body time of frames that stepped the body; time spent on it, a part of frame_time_sum
  BinCounts frame_seconds{kSecondsEdges};    ///< for all of `frames`: from next_job() to finish()
  BinCounts patches_seconds{kSecondsEdges};  ///< time to build the patches, for frames with at least one patch
};

/// Rate and delay that a room achieves.
struct Pace {
  double rate_hz = 0;  ///< frames per second over the last second; the configured rate if none was skipped for lack of time
  Micros behind{};     ///< age of the body's newest state when it was computed
};

/// State of the body as reported to stations and viewers.
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

  /// Returns false if a frame is due that does not begin now: one is still being computed, or there are no newer samples.
  [[nodiscard]] bool tick(Stations& stations, Micros now);
  /// Restarts the time of an empty room when a station joins.
  void wake(Micros now);
  /// Latest moment for the next tick(); Micros::max() if only a new station can make a frame due.
  Micros deadline(const Stations& stations) const;
  std::optional<FrameJob> next_job(Micros now);
  void finish(const FrameResult& result, Stations& stations, Micros now);

  /// Returns true if a station that has seen `resets` resets asks for another one. Any other number is a request already
  /// fulfilled.
  bool is_new_reset(std::uint16_t resets) const { return resets == static_cast<std::uint16_t>(counts_.resets); }
  /// Puts the body back to rest with the next frame.
  void reset();
  /// Drops the frame that has not begun; with `ended`, no frame begins any more.
  void drop_job(bool ended);
  bool ended() const { return ended_; }
  /// Start of the frame that is being computed; empty if there is none.
  std::optional<Micros> computing_since() const { return job_out_ ? std::optional(job_began_) : std::nullopt; }

  Micros body_time() const { return body_time_; }
  BodyNow body(Micros now) const;
  Micros horizon(const Station& station) const;
  const Pace& pace() const { return pace_; }
  const FrameCounts& counts() const { return counts_; }
  FrameBudget& detail() { return detail_; }
  /// Longest frame time since the last reset_longest_frame(), for periodic reports.
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
  bool owed_ = false;    ///< true while a due frame has not begun
  bool asleep_ = false;  ///< true if the body slept in the last frame
  bool reset_due_ = false;
  std::optional<FrameJob> job_;
  Micros first_tick_{}, body_time_{}, job_began_{}, compute_mean_{}, longest_frame_{};
  Micros lag_{};  ///< age of the body's state at the moment its frame falls due
  std::uint64_t next_frame_ = 0;
  std::deque<std::uint8_t>
      lately_;  ///< frames that fell due in the last second: 1 if skipped because the one before took too long
  Pace pace_;
  FrameMeter meter_;
  FrameBudget detail_;
  FrameCounts counts_;
};

}  // namespace palpate
