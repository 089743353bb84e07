// An attacker on the path that sees each Init and answers it before the server, after it, or both.
#include <catch2/catch.hpp>

#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Side {
  int before, after;  ///< forged cookies before and after the server's
};

/// The client's handshake index is no secret; a cookie is 16 bytes that only the server can make.
struct Liar {
  Random random{5};

  Datagram cookie(const Datagram& init) {
    Datagram cookie(kCookieBytes);
    put_head(cookie, ChannelKind::cookie, index_of(init));
    for (std::size_t k = kHeadBytes; k < cookie.size(); ++k) cookie[k] = static_cast<std::uint8_t>(random.bits());
    return cookie;
  }
};

constexpr Micros kStep{10'000};

/// Drives both ends until `until`; server and attacker answer the client's channel. Returns for how much of that time the client
/// could send.
Micros drive(ChannelPair& pair, Liar& liar, Side side, Micros until) {
  Micros ready{};
  for (; pair.now < until; pair.now += kStep) {
    pair.server.tick(pair.now);
    for (const Datagram& init : pair.from_client()) {
      for (int k = 0; k < side.before; ++k) pair.to_client(liar.cookie(init));
      pair.to_server(init);
      for (const Datagram& answer : pair.from_server()) pair.to_client(answer);
      for (int k = 0; k < side.after; ++k) pair.to_client(liar.cookie(init));
    }
    if (!pair.client.ready(pair.now)) continue;
    ready += kStep;
    const auto opened = pair.to_server(pair.sealed("samples"));
    if (opened) pair.to_client(pair.sealed_by_server(opened->peer, "a patch"));
  }
  return ready;
}

}  // namespace

TEST_CASE("forged cookies of somebody on the way do not keep a station out") {
  for (const Side side : {Side{1, 0}, Side{0, 1}, Side{1, 1}, Side{10, 10}}) {
    ChannelPair pair;
    Liar liar;
    const Micros begin = pair.now;
    drive(pair, liar, side, begin + Micros{60'000'000});
    INFO(side.before << " before, " << side.after << " behind");
    CHECK(pair.client.counts().handshakes == 1);
    CHECK(pair.client.ready(pair.now));
  }
}

TEST_CASE("forged cookies of somebody on the way do not keep new keys from a session") {
  for (const Side side : {Side{1, 0}, Side{0, 1}, Side{1, 1}, Side{10, 10}}) {
    ChannelPair pair;
    Liar liar;
    REQUIRE(pair.join() != 0);
    const Micros begin = pair.now, length{1'200'000'000};
    INFO(side.before << " before, " << side.after << " behind");
    CHECK(drive(pair, liar, side, begin + length) == length);
    CHECK(pair.client.counts().handshakes >= 7);
    CHECK(pair.server.counts().sessions == 1);
  }
}

TEST_CASE("a flood of forged cookies has a client send no more than eight handshakes a second") {
  ChannelPair pair;
  Liar liar;
  const Micros begin = pair.now, length{10'000'000};
  std::uint64_t sent = 0;
  Datagram last;
  for (; pair.now < begin + length; pair.now += Micros{1000}) {
    for (const Datagram& init : pair.from_client()) last = init, ++sent;
    for (int k = 0; k < 10; ++k) pair.to_client(liar.cookie(last));
  }
  CHECK(sent <= 8 * 10 + 1);
}
