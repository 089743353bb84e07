// How many handshakes a server computes: token buckets, one for each prefix (an IPv4 address, 64 bits of an IPv6 one) and one for
// all. A handshake costs two X25519 before the sender is known; without a limit a few Mbit/s would keep a processor busy.
//
// Those from the host of a session do not share the bucket for all, and those from its very address and port have one of their
// own: strangers who empty the others keep newcomers out, but no session from its next keys, even from the same host or from
// behind the same translator of addresses.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "common/base/types.hpp"
#include "common/trust/channel_wire.hpp"

namespace palpate {

inline constexpr int kHandshakesPrefix = 20, kHandshakesAll = 200;  ///< a second; as many at once

/// What lives where a handshake comes from.
enum class Neighbour : std::uint8_t { none, session_of_host, session };

class HandshakeLimits {
 public:
  bool allow(const ChannelAddress& from, Neighbour lives, Micros now);

 private:
  struct Bucket {
    double left = 0;
    Micros at{};
    double left_at(double rate, Micros now) const;
    bool take(double rate, Micros now);
    void fill(double rate, Micros now);
  };
  using Prefix = std::pair<std::array<std::uint8_t, 16>, std::uint16_t>;  ///< with a port: of a session
  void forget_full(Micros now);

  Bucket all_{kHandshakesAll, {}};
  std::map<Prefix, Bucket> prefixes_;  ///< those that lack some: as all_ is asked first, a few hundred, and where sessions live
  Micros swept_{};
};

}  // namespace palpate
