// Offset, drift and round trip between our clock and the peer's, from the stamps that every datagram carries.
//
// A datagram sent by the peer at `sent` (its clock) and received at `now` (ours), echoing our datagram of `echo` that it got
// `echo_hold` before, says about the offset theta = peer clock - our clock:
//
//     now - sent                = -theta + delay towards us
//     (sent - echo_hold) - echo = +theta + delay towards the peer
//
// The smallest of each over the last kWindow, corrected for drift, are the two delays without queueing, so
//
//     theta = (least second - least first) / 2,     error <= half the difference of the two least delays (path asymmetry).
//
// The two minima are found apart: a quiet datagram each way is enough, they need not belong to one round trip. Drift is the
// least-squares slope of theta over the last minute. The offset that maps times is slewed towards theta with time constant
// kSlewTime and at most kSlewMax, so that mapped times stay monotone. It only jumps where a datagram proves it wrong: each proves
//
//     sent - now <= theta <= sent - echo_hold - echo          (no delay is negative)
//
// at once, so that a clock that stepped (a machine that was suspended) is off by less than the way of one datagram with the next,
// and nothing that the peer sent is ever mapped to after it came. The two least delays add up to the least round trip; a sum
// below -kStepLeast is impossible but for such a step: then the delays seen before it are forgotten, and the offset is found anew
// from the first exchange that began after it.
//
// What one datagram says that is not so must not outlast it. A `sent` more than kLeadMost ahead of what the newest datagram lets
// expect is no step, as a session does not outlive such a pause: it is put aside. After a step ahead what the peer sent before it
// is ignored; where nothing else comes for kDoubtFor, and kDoubted datagrams at least, there was no step, or it was taken back:
// the offset is found anew from them. The same holds for datagrams put aside, so that whatever is said, a clock that goes on
// steadily is found.
#pragma once

#include <array>
#include <deque>
#include <limits>

#include "common/base/types.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

struct RttStats {
  Micros last{};    ///< of the newest exchange
  Micros min{};     ///< least delay there plus least delay back, over the window
  Micros mean{};    ///< exponential average
  Micros jitter{};  ///< exponential average of the change from one exchange to the next
};

/// The smallest of the values that came within the last kWindow. Values may follow a known slope [us/us].
class WindowedMinimum {
 public:
  static constexpr Micros kBucket{500'000};
  static constexpr int kBuckets = 16;
  static constexpr Micros kWindow{kBucket * kBuckets};

  void add(Micros t, double value);
  bool empty() const { return newest_ == kNone; }
  /// Every value carried along the slope to `now`. Not for an empty window.
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
  static constexpr double kSlewMax = 2e-3;      ///< of elapsed time
  static constexpr double kDriftMax = 500e-6;   ///< a quartz that is worse is broken
  static constexpr Micros kRttMax{10'000'000};  ///< exchanges beyond this are nonsense and ignored

  static constexpr Micros kStepLeast{5'000};  ///< more than drift makes of a window
  static constexpr Micros kLeadMost{20'000'000};
  static constexpr int kDoubted = 8;
  static constexpr Micros kDoubtFor{100'000};
  static constexpr Micros kHoldMax{60'000'000};  ///< a datagram held for longer is not echoed any more

  /// What our next datagram says.
  ClockStamps stamp(Micros now) const;
  /// What a datagram of the peer said that came at `now` (our clock, ascending). Order and duplicates do not matter.
  void take(const ClockStamps& peer, Micros now);

  bool locked() const { return locked_; }
  /// Instants from our clock to the peer's and back; exact inverses between two calls of take(). Need locked().
  Micros to_peer(Micros own) const { return own + offset(); }
  Micros from_peer(Micros peer) const { return peer - offset(); }

  Micros offset() const { return from_micros(offset_us_); }
  double drift_ppm() const { return drift_ * 1e6; }
  const RttStats& rtt() const { return rtt_; }
  std::uint64_t exchanges() const { return exchanges_; }
  std::uint64_t steps() const { return steps_; }  ///< of one of the two clocks, since the first lock

 private:
  /// Datagrams one after the other that contradict what is known.
  struct Doubt {
    int count = 0;
    Micros since{};
    /// Another one; true when there is enough of it.
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
  Micros ignored_before_{Micros::min()};  ///< datagrams that the peer sent before a step
  Doubt doubt_;
  Micros echoes_from_{Micros::min()};  ///< echoes of what we sent before it: a hold may span the step
};

}  // namespace palpate
