// Both ends of the trust channel with a session between them, for its fuzzers.
#pragma once

#include <cstdlib>

#include "tests/common/trust/channel_pair.hpp"
#include "tests/fuzz/script.hpp"

namespace palpate::test {

inline void require(bool condition) {
  if (!condition) std::abort();
}

struct JoinedPair : ChannelPair {
  JoinedPair() { require(peer != 0); }

  struct Taken {
    std::optional<ServerChannel::Opened> opened;
    std::vector<Datagram> answers;
  };
  /// Delivers a datagram to the server from this host; the server answers with no more bytes than it received.
  Taken take(const Datagram& datagram, int host) {
    from = address_of(host, 4711);
    Taken taken{to_server(datagram), from_server()};
    std::size_t answered = 0;
    for (const Datagram& answer : taken.answers) answered += answer.size();
    require(answered <= datagram.size());
    return taken;
  }

  ChannelPeer peer = join();
};

}  // namespace palpate::test
