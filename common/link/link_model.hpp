// One direction of a bad link, seeded: applied by palpate-relay to real datagrams and by the simulated world to virtual ones.
//
// A datagram first waits for the wire, then travels, and may be lost on the way:
//   bandwidth  the wire carries kbit_s; datagrams (with kHeaderBytes each) queue for it, and one that would wait longer than
//              kMaxBacklog is dropped (tail drop). 0 = unlimited.
//   loss       Gilbert-Elliott: a good state loses nothing, a bad one everything. The long-run share of lost datagrams is `loss`,
//              the mean run of losses burst_mean datagrams; burst_mean = 0 (or less than independent losses give, 1 / (1 - loss))
//              makes losses independent.
//   latency    uniform in [latency - jitter, latency + jitter], never negative. Order is kept: a datagram does not arrive before
//              one that was sent before it.
//   reorder    with this probability a datagram leaves that order: it is held for a further uniform (0, kReorderHold],
//              and later ones overtake it.
//   duplicate  with this probability a second copy arrives together with the first.
// Every datagram draws the same number of random numbers, so that two specs with one seed differ only where they differ.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

#include "common/base/random.hpp"
#include "common/base/types.hpp"

namespace palpate {

struct LinkSpec {
  Micros latency{}, jitter{};
  double loss = 0;                    ///< share of datagrams, 0 to 1
  double burst_mean = 0;              ///< datagrams, 0 = independent losses
  double duplicate = 0, reorder = 0;  ///< shares of datagrams, 0 to 1
  double kbit_s = 0;                  ///< 0 = unlimited
  std::uint64_t seed = 1;
};

/// Throws InputError when a number is out of range; `where` names the owner of the spec.
void validate(const LinkSpec& spec, std::string_view where);

/// Arrival times of the copies of one datagram; none when it is lost.
struct Deliveries {
  std::array<Micros, 2> at{};
  int count = 0;
  const Micros* begin() const { return at.data(); }
  const Micros* end() const { return at.data() + count; }
};

struct LinkCounts {
  std::uint64_t sent = 0, lost = 0, queue_dropped = 0, duplicated = 0, reordered = 0, bytes = 0;
};

class LinkModel {
 public:
  static constexpr Micros kMaxBacklog{200'000}, kReorderHold{20'000};
  static constexpr std::size_t kHeaderBytes = 28;  ///< IPv4 and UDP

  explicit LinkModel(const LinkSpec& spec);
  /// Passes a datagram of `bytes` into the link; `now` never decreases between calls.
  Deliveries schedule(Micros now, std::size_t bytes);
  /// Changes the link (for example heals it); the random numbers continue, the seed of `spec` is ignored.
  void change(const LinkSpec& spec);
  const LinkCounts& counts() const { return counts_; }

 private:
  bool loses();
  Micros serialise(Micros now, std::size_t bytes);

  LinkSpec spec_;
  Random random_;
  bool bad_ = false;
  double into_bad_ = 0, out_of_bad_ = 1;  ///< probabilities of a change of state before the next datagram
  double wire_free_us_ = 0;
  Micros last_arrival_{std::numeric_limits<std::int64_t>::min()};
  LinkCounts counts_;
};

}  // namespace palpate
