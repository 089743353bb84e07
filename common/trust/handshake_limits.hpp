// Limits on the handshakes that a server computes: token buckets.
//
//     examined    one X25519 finds the claimed identity        of a prefix 1000 a second, of all 2000
//     continued   with a known key                             of the key 20
//                 with an unknown key and perhaps a token      of a prefix 20, of all 200
//
// A prefix is an IPv4 address, or 64 bits of an IPv6 one. Without the first limit a few Mbit/s would keep a processor busy. The
// others are separate because a station's key is known to itself and the server alone (an Init carries it sealed): strangers who
// exhaust the first ones do not affect stations with a known key; and anyone who did learn a key keeps nobody else out.
//
// Handshakes from the host of a session do not share the bucket for all, and those from its exact address and port have a bucket
// of their own: strangers who exhaust the others keep newcomers out, but no session from its next keys, even from the same host
// or from behind the same NAT.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "common/base/types.hpp"
#include "common/trust/channel_wire.hpp"

namespace palpate {

inline constexpr int kLooksPrefix = 1000, kLooksAll = 2000;         ///< per second, and burst size
inline constexpr int kHandshakesPrefix = 20, kHandshakesAll = 200;  ///< with a token
inline constexpr int kHandshakesKey = 20;                           ///< per known key, or per address of a session

/// Relation of a handshake's source to existing sessions.
enum class Neighbour : std::uint8_t { none, session_of_host, session };

class TokenBucket {
 public:
  bool has(double rate, Micros now) const { return left_at(rate, now) >= 1; }
  bool is_full(double rate, Micros now) const { return left_at(rate, now) >= rate; }
  bool take(double rate, Micros now);
  static TokenBucket full(double rate, Micros now) { return {rate, now}; }

 private:
  TokenBucket(double left, Micros at) : left_(left), at_(at) {}
  double left_at(double rate, Micros now) const;

  double left_;
  Micros at_;
};

/// A bucket for each key of a map; full ones are not stored.
template <class Key>
class TokenBuckets {
 public:
  bool take(const Key& key, double rate, Micros now) {
    if (now - swept_ >= kSweepEvery) {
      swept_ = now;
      std::erase_if(buckets_, [&](const auto& entry) { return entry.second.is_full(rate, now); });
    }
    return buckets_.try_emplace(key, TokenBucket::full(rate, now)).first->second.take(rate, now);
  }

 private:
  static constexpr Micros kSweepEvery{1'000'000};
  std::map<Key, TokenBucket> buckets_;
  Micros swept_{};
};

/// Limits per second for a prefix and for all.
class PlaceLimits {
 public:
  PlaceLimits(int prefix, int all) : prefix_(prefix), all_rate_(all), all_(TokenBucket::full(all, {})) {}
  bool allow(const ChannelAddress& from, Neighbour lives, Micros now);

 private:
  using Place = std::array<std::uint8_t, 16>;
  int prefix_, all_rate_;
  TokenBucket all_;
  TokenBuckets<Place> prefixes_;  ///< bounded because all_ is asked first, plus those of sessions
  TokenBuckets<ChannelAddress> sessions_;
};

class HandshakeLimits {
 public:
  /// True when the sender's identity may be examined.
  bool may_look(const ChannelAddress& from, Neighbour lives, Micros now) { return looks_.allow(from, lives, now); }
  /// True when a handshake with this known key may continue.
  bool may_go_on(const PublicKey& key, Neighbour lives, Micros now) {
    return lives == Neighbour::session || keys_.take(key, kHandshakesKey, now);
  }
  /// True when a handshake with an unknown key may continue.
  bool may_try_token(const ChannelAddress& from, Neighbour lives, Micros now) { return tokens_.allow(from, lives, now); }

 private:
  PlaceLimits looks_{kLooksPrefix, kLooksAll}, tokens_{kHandshakesPrefix, kHandshakesAll};
  TokenBuckets<PublicKey> keys_;
};

}  // namespace palpate
