// Handshakes of the trust channel: when a session results, their cost for each side, and when the next one begins.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/common/trust/recorded_join.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("a station that the server knows has a session after two round trips, and data goes both ways") {
  ChannelPair pair;
  REQUIRE(pair.shake_hands());
  CHECK(pair.server.counts().sessions == 0);  // the client has sent no data yet
  const auto opened = pair.to_server(pair.sealed("a hand"));
  REQUIRE(opened);
  CHECK(pair.text(opened->size) == "a hand");
  CHECK(pair.server.counts().sessions == 1);
  CHECK(*pair.server.key(opened->peer) == public_of(secret_of(kStationSeed)));
  CHECK(pair.server.rights(opened->peer)->name == "OR 3");
  const std::size_t size = pair.to_client(pair.sealed_by_server(opened->peer, "a patch"));
  CHECK(pair.text(size) == "a patch");
  CHECK(pair.to == pair.from);
}

TEST_CASE("the datagrams have the sizes that the page of the wire says") {
  Recorded seen;
  CHECK(seen.asking.size() == 512);
  CHECK(seen.cookie.size() == 24);
  CHECK(seen.resp.size() == 60);
  REQUIRE(seen.pair.to_client(seen.resp) == 0);
  CHECK(seen.pair.sealed("12345").size() == 32 + 5);
}

TEST_CASE("before a cookie came back the server holds nothing and sends less than it got") {
  ChannelPair pair;
  const Datagram asking = pair.from_client().at(0);
  for (int k = 0; k < 1000; ++k) {
    pair.to_server(asking);
    const auto answers = pair.from_server();
    REQUIRE(answers.size() == 1);
    CHECK(answers[0].size() == kCookieBytes);
  }
  CHECK(pair.server.sessions() == 0);
  CHECK(pair.server.counts().answers == 0);
}

TEST_CASE("a cookie counts only for the address, port and index that it was made for") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  pair.server.forget(1);  // the session that Recorded began
  for (const ChannelAddress& other : {address_of(1, 4712), address_of(2, 4711)}) {
    pair.from = other;
    pair.to_server(seen.init);
    const auto answers = pair.from_server();
    REQUIRE(answers.size() == 1);
    CHECK(answers[0].size() == kCookieBytes);
  }
  Datagram other_index = seen.init;
  other_index[4] ^= 1;
  pair.from = address_of(1, 4711);
  pair.to_server(with_mac(other_index));
  CHECK(pair.from_server().at(0).size() == kCookieBytes);
  CHECK(pair.server.sessions() == 0);
}

TEST_CASE("a cookie is good for 120 s at least and 240 s at most") {
  const auto answered_after = [](Micros wait) {
    Recorded seen;
    seen.pair.server.forget(1);
    seen.pair.now += wait;
    seen.pair.to_server(seen.init);
    return seen.pair.from_server().at(0).size() == kRespBytes;
  };
  CHECK(answered_after(Micros{119'000'000}));
  CHECK_FALSE(answered_after(Micros{240'000'000}));
}

TEST_CASE("a server is silent to a station whose key it does not know") {
  ChannelPair pair(site_keys(), client_keys(kStrangerSeed));
  CHECK_FALSE(pair.shake_hands());
  CHECK(pair.server.counts().answers == 0);
  CHECK(pair.server.counts().of(ChannelFault::unknown_key) == 1);
  const auto refusal = pair.server.take_refusal();
  REQUIRE(refusal);
  CHECK(refusal->key == public_of(secret_of(kStrangerSeed)));
}

TEST_CASE("a server is silent to a station that believes another server, also where its mac was made for this one") {
  ChannelPair pair(site_keys(), client_keys(kStationSeed, kStrangerSeed));
  const Datagram asking = pair.from_client().at(0);
  pair.to_server(asking);
  CHECK(pair.from_server().empty());
  CHECK(pair.server.counts().of(ChannelFault::mac) == 1);
  Datagram mended = with_mac(asking);
  pair.to_server(mended);
  const Datagram cookie = pair.from_server().at(0);
  std::copy(cookie.end() - kMacBytes, cookie.end(), mended.end() - kMacBytes);
  pair.to_server(mended);
  CHECK(pair.from_server().empty());
  CHECK(pair.server.counts().of(ChannelFault::handshake) == 1);
}

TEST_CASE("a client does not take an answer of a server that has not the key it believes in") {
  ChannelPair genuine, impostor([] {
    SiteKeys keys = site_keys();
    keys.self = secret_of(kStrangerSeed);
    return keys;
  }());
  // The impostor does a handshake with the same client key; its answer, addressed to the genuine client's index, is useless.
  impostor.client = ClientChannel(client_keys(kStationSeed, kStrangerSeed), 5, seeded(107), impostor.now);
  impostor.to_server(impostor.from_client().at(0));
  impostor.to_client(impostor.from_server().at(0));
  impostor.to_server(impostor.from_client().at(0));
  Datagram resp = impostor.from_server().at(0);
  const Datagram asking = genuine.from_client().at(0);
  std::copy_n(asking.begin() + 4, 4, resp.begin() + 4);
  genuine.to_client(resp);
  CHECK_FALSE(genuine.client.ready(genuine.now));
  CHECK(genuine.client.counts().forged == 1);
  genuine.now += kInitEvery;
  CHECK(genuine.shake_hands());  // and did not disturb the handshake
}

TEST_CASE("an older handshake of a session that comes late is not answered") {
  ChannelPair pair;
  pair.to_server(pair.from_client().at(0));
  pair.to_client(pair.from_server().at(0));
  const Datagram first = pair.from_client().at(0);  // with a cookie; it gets lost
  pair.now += kAttemptLasts;
  REQUIRE(pair.join() != 0);
  const auto stale = pair.server.counts().of(ChannelFault::stale);
  pair.to_server(first);
  CHECK(pair.from_server().empty());
  CHECK(pair.server.counts().of(ChannelFault::stale) == stale + 1);
}

TEST_CASE("a hint about the keys in use begins a handshake beside the session, and one about others does nothing") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  pair.now += Micros{2'000'000};
  Datagram hint(kHintBytes);
  put_head(hint, ChannelKind::hint, index_of(pair.sealed("x")) ^ 1);
  pair.to_client(hint);
  CHECK(pair.from_client().empty());
  hint[4] ^= 1;
  pair.to_client(hint);
  CHECK(pair.from_client().size() == 1);
  CHECK(pair.client.ready(pair.now));
  CHECK(pair.to_server(pair.sealed("on as ever"))->peer == peer);
}

TEST_CASE("a server that restarted hints, and the station has a session again without being told anything else") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  ChannelPair restarted(site_keys(), client_keys(), 900);
  restarted.client = pair.client;
  restarted.now = pair.now + Micros{2'000'000};
  CHECK_FALSE(restarted.to_server(restarted.sealed("samples")));
  const auto answers = restarted.from_server();
  REQUIRE(answers.size() == 1);
  CHECK(answers[0].size() == kHintBytes);
  restarted.to_client(answers[0]);
  REQUIRE(restarted.shake_hands());
  CHECK(restarted.to_server(restarted.sealed("hello")));
}

TEST_CASE("a station that hears nothing for three seconds shakes hands anew, its keys still in use") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  pair.sealed("asked");
  pair.now += Micros{2'900'000};
  CHECK(pair.from_client().empty());
  pair.now += Micros{200'000};
  CHECK(pair.from_client().size() == 1);
  CHECK(pair.client.ready(pair.now));
}
