// Offset, drift and round trip between our clock and the peer's, from the stamps that every datagram carries.
//
// A datagram sent by the peer at `sent` (its clock) and received at `now` (ours), echoing our datagram of `echo`, which it
// received `echo_hold` earlier, gives for the offset theta = peer clock - our clock:
//
//     now - sent                = -theta + delay towards us
//     (sent - echo_hold) - echo = +theta + delay towards the peer
//
// The smallest of each over the last kWindow, corrected for drift, are the two delays without queueing, so
//
//     theta = (least second - least first) / 2,     error <= half the difference of the two least delays (path asymmetry).
//
// The two minima are found independently: one datagram without queueing each way is enough, they need not belong to one round
// trip. Drift is the least-squares slope of theta over the last minute. The offset that maps times is slewed towards theta with
// time constant kSlewTime and at most kSlewMax, so that mapped times stay monotone. It only jumps where a datagram proves it
// wrong: each proves
//
//     sent - now <= theta <= sent - echo_hold - echo          (no delay is negative)
//
// at once. So after a step of a clock (a machine that was suspended) the next datagram limits the error to less than its own
// delay, and nothing that the peer sent is ever mapped to after its arrival. The two least delays add up to the least round trip;
// a sum below -kStepLeast is impossible without such a step: then the delays seen before it are discarded, and the offset is
// found anew from the first exchange that began after it.
//
// A false claim of one datagram must not outlast it. A `sent` more than kLeadMost ahead of the value expected from the newest
// datagram is no step, because a session does not outlive such a pause: the datagram is set aside. After a step ahead, datagrams
// that the peer sent before it are ignored; if only such datagrams arrive for kDoubtFor, and at least kDoubted of them, there was
// no step, or it was undone: the offset is found anew from them. The same holds for datagrams set aside, so that a clock that
// advances steadily is found whatever is claimed.
#pragma once

#include <array>
#include <deque>
#include <limits>

#include "common/base/types.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

struct RttStats {
  Micros last{};    ///< that of the newest exchange
  Micros min{};     ///< least delay there plus least delay back, over the window
  Micros mean{};    ///< exponential average
  Micros jitter{};  ///< exponential average of the change from one exchange to the next
};

/// The smallest of the values of the last kWindow. Values may follow a known slope [us/us].
class WindowedMinimum {
 public:
  static constexpr Micros kBucket{500'000};
  static constexpr int kBuckets = 16;
  static constexpr Micros kWindow{kBucket * kBuckets};

  void add(Micros t, double value);
  bool empty() const { return newest_ == kNone; }
  /// Returns the minimum of the values extrapolated along the slope to `now`. Not for an empty window.
  double at(Micros now, double slope) const;

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
  struct Bucket {
    std::int64_t index = kNone;
    Micros t{};
    double value = 0;
  };
  std::array<Bucket, kBuckets> buckets_{};
  std::int64_t newest_ = kNone;
};

class ClockSync {
 public:
  static constexpr Micros kSlewTime{1'000'000};
  static constexpr double kSlewMax = 2e-3;      ///< share of elapsed time
  static constexpr double kDriftMax = 500e-6;   ///< a worse quartz is defective
  static constexpr Micros kRttMax{10'000'000};  ///< longer exchanges are ignored as invalid

  static constexpr Micros kStepLeast{5'000};  ///< more than the drift over a window
  static constexpr Micros kLeadMost{20'000'000};
  static constexpr int kDoubted = 8;
  static constexpr Micros kDoubtFor{100'000};
  static constexpr Micros kHoldMax{60'000'000};  ///< a datagram held longer is not echoed any more

  /// Returns the stamps of our next datagram.
  ClockStamps stamp(Micros now) const;
  /// Processes the stamps of a datagram that arrived at `now` (our clock, ascending). Order and duplicates do not matter.
  void take(const ClockStamps& peer, Micros now);

  bool locked() const { return locked_; }
  /// Convert instants from our clock to the peer's and back; exact inverses between two calls of take(). Need locked().
  Micros to_peer(Micros own) const { return own + offset(); }
  Micros from_peer(Micros peer) const { return peer - offset(); }

  Micros offset() const { return from_micros(offset_us_); }
  double drift_ppm() const { return drift_ * 1e6; }
  const RttStats& rtt() const { return rtt_; }
  std::uint64_t exchanges() const { return exchanges_; }
  std::uint64_t steps() const { return steps_; }  ///< steps of one of the two clocks, since the first lock

 private:
  /// Successive datagrams that contradict the current offset.
  struct Doubt {
    int count = 0;
    Micros since{};
    /// Counts one more; returns true when there are enough.
    bool grows(Micros now);
  };
  static Micros from_micros(double us) { return from_seconds(us * 1e-6); }
  void measure(const ClockStamps& peer, Micros now);
  bool is_whole(const ClockStamps& peer) const;
  bool has_stepped(Micros now) const;
  bool is_beyond(const ClockStamps& peer, Micros now) const;
  bool is_to_be_ignored(const ClockStamps& peer, Micros now);
  void forget(const ClockStamps& peer, Micros now);
  void keep_within(const ClockStamps& peer, Micros now);
  void slew(Micros now);
  void watch_drift(Micros now);

  Micros heard_sent_{}, heard_at_{};  ///< newest datagram of the peer
  bool heard_ = false, locked_ = false, lost_ = false;
  WindowedMinimum towards_us_, towards_peer_;
  double offset_us_ = 0, drift_ = 0;
  Micros filling_since_{}, slewed_at_{}, watched_at_{};
  struct Seen {
    double t_s, theta_us;
  };
  std::deque<Seen> seen_;
  RttStats rtt_;
  std::uint64_t exchanges_ = 0, steps_ = 0;
  Micros ignored_before_{Micros::min()};  ///< limit of the send time of ignored datagrams, those before a step
  Doubt doubt_;
  Micros echoes_from_{Micros::min()};  ///< limit of our send time for echoes: an earlier hold may span the step
};

}  // namespace palpate
