// Strangers and attackers on the path have no effect on the trust channel.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/common/trust/recorded_join.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("nothing that is cut short, of any kind, does anything at either end") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  const auto answers_before = pair.server.counts().answers;
  for (const Datagram& whole : {seen.asking, seen.cookie, seen.init, seen.resp}) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const Datagram cut(whole.begin(), whole.begin() + static_cast<long>(size));
      CHECK_FALSE(pair.to_server(cut));
      CHECK(pair.to_client(cut) == 0);
    }
  }
  CHECK_FALSE(pair.client.ready(pair.now));
  CHECK(pair.from_server().empty());
  CHECK(pair.server.counts().answers == answers_before);
  pair.to_client(seen.resp);
  REQUIRE(pair.client.ready(pair.now));
  const Datagram data = pair.sealed("a hand");
  for (std::size_t size = 0; size < data.size(); ++size)
    CHECK_FALSE(pair.to_server(Datagram(data.begin(), data.begin() + static_cast<long>(size))));
  CHECK(pair.to_server(data));
}

TEST_CASE("no flipped bit of an Init gets an answer, even from one who makes a new mac and has a cookie for it") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  const auto sessions = pair.server.sessions();
  for (std::size_t bit = 0; bit < 8 * kInitSigned; ++bit) {
    Datagram bad = seen.init;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    pair.to_server(bad);
    REQUIRE(pair.from_server().empty());
    if (bit % 8 != bit / 8 % 8) continue;  // one bit per byte, as each costs a Diffie-Hellman
    bad = with_mac(bad);
    pair.now += Micros{120'000};
    pair.to_server(bad);
    const auto cookie = pair.from_server();
    if (!cookie.empty() && cookie[0].size() == kCookieBytes)
      std::copy(cookie[0].end() - kMacBytes, cookie[0].end(), bad.end() - kMacBytes);
    pair.to_server(bad);
    INFO("bit " << bit);
    REQUIRE(pair.from_server().empty());
  }
  CHECK(pair.server.sessions() == sessions);
  CHECK(pair.server.counts().of(ChannelFault::handshake) > 400);
}

TEST_CASE("no flipped bit of an answer or of data is taken, and the genuine one is after all of them") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  for (std::size_t bit = 0; bit < 8 * kRespBytes; ++bit) {
    Datagram bad = seen.resp;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    pair.to_client(bad);
    INFO("bit " << bit);
    REQUIRE_FALSE(pair.client.ready(pair.now));
  }
  pair.to_client(seen.resp);
  REQUIRE(pair.client.ready(pair.now));
  const Datagram up = pair.sealed("a hand");
  for (std::size_t bit = 0; bit < 8 * up.size(); ++bit) {
    Datagram bad = up;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    INFO("bit " << bit);
    REQUIRE_FALSE(pair.to_server(bad));
  }
  const auto opened = pair.to_server(up);
  REQUIRE(opened);
  const Datagram down = pair.sealed_by_server(opened->peer, "a patch");
  for (std::size_t bit = 0; bit < 8 * down.size(); ++bit) {
    Datagram bad = down;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    INFO("bit " << bit);
    REQUIRE(pair.to_client(bad) == 0);
  }
  CHECK(pair.to_client(down) == 7);
}

TEST_CASE("what was sent before and comes again changes nothing, whatever kind it is of") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  pair.to_client(seen.resp);
  const Datagram data = pair.sealed("a hand");
  const auto opened = pair.to_server(data);
  REQUIRE(opened);
  const Datagram patch = pair.sealed_by_server(opened->peer, "a patch");
  REQUIRE(pair.to_client(patch) > 0);

  const auto computed = pair.server.counts().answers;
  for (int k = 0; k < 3; ++k) {
    pair.to_server(seen.init);
    const auto answers = pair.from_server();
    REQUIRE(answers.size() == 1);
    CHECK(answers[0] == seen.resp);  // the same bytes: nothing was computed, and they are useless to others
    CHECK_FALSE(pair.to_server(data));
    pair.to_client(seen.cookie);
    pair.to_client(seen.resp);
    CHECK(pair.to_client(patch) == 0);
  }
  CHECK(pair.server.counts().answers == computed);
  CHECK(pair.server.counts().of(ChannelFault::replayed) == 3);
  CHECK(pair.client.counts().replayed == 3);
  CHECK(pair.server.sessions() == 1);
  CHECK(pair.client.counts().handshakes == 1);
  CHECK(pair.to_server(pair.sealed("on")));
}

TEST_CASE("what one side sent is of no use when it is sent back to it") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  REQUIRE(peer != 0);
  const Datagram up = pair.sealed("a hand");
  CHECK(pair.to_client(up) == 0);
  const Datagram down = pair.sealed_by_server(peer, "a patch");
  CHECK_FALSE(pair.to_server(down));
  // Even with the index that the receiver expects, the direction's key does not fit.
  Datagram turned = up;
  std::copy_n(down.begin() + 4, 4, turned.begin() + 4);
  CHECK(pair.to_client(turned) == 0);
  CHECK(pair.client.counts().forged == 1);
  Datagram back = down;
  std::copy_n(up.begin() + 4, 4, back.begin() + 4);
  back[8] = 77;  // a counter that has not been used
  CHECK_FALSE(pair.to_server(back));
  CHECK(pair.server.counts().of(ChannelFault::forged) == 1);
}

TEST_CASE("whoever has not proven a key gets at most as many bytes as he sends, whatever he sends") {
  Recorded seen;
  ChannelPair& pair = seen.pair;
  pair.to_client(seen.resp);
  const std::vector<Datagram> seeds{seen.asking, seen.cookie, seen.init, seen.resp, pair.sealed("a hand")};
  Random random(3);
  for (int k = 0; k < 20'000; ++k) {
    Datagram bytes = seeds[random.bits() % seeds.size()];
    for (std::uint64_t flips = random.bits() % 4; flips > 0; --flips)
      bytes[random.bits() % bytes.size()] ^= static_cast<std::uint8_t>(random.bits());
    if (random.chance(0.2)) bytes.resize(random.bits() % 1300);
    pair.from = address_of(static_cast<int>(random.bits() % 250), static_cast<int>(random.bits() % 60'000));
    pair.now += Micros{1000};
    pair.to_server(bytes);
    std::size_t out = 0;
    for (const Datagram& answer : pair.from_server()) out += answer.size();
    REQUIRE(out <= bytes.size());
  }
  CHECK(pair.server.sessions() <= 1);
}

namespace {

/// Does handshakes as another client with its own seed, which temporarily replaces the client of the pair.
void shake_hands_as(ChannelPair& pair, const ClientKeys& keys, std::uint64_t seed, const ChannelAddress& from) {
  pair.client = ClientChannel(keys, 5, seeded(seed), pair.now);
  pair.from = from;
  pair.shake_hands();
}

}  // namespace

TEST_CASE("of strangers a server looks into 1000 handshakes a second from a prefix, and into 2000 from all") {
  const auto looked_into = [](int hosts, int each) {
    ChannelPair pair;
    for (int k = 0; k < hosts * each; ++k)
      shake_hands_as(pair, client_keys(kStrangerSeed), static_cast<std::uint64_t>(1000 + k),
                     address_of(k % hosts, 5000 + k / hosts));
    const auto& counts = pair.server.counts();
    CHECK(counts.of(ChannelFault::limit) + counts.of(ChannelFault::unknown_key) == static_cast<std::uint64_t>(hosts * each));
    return counts.of(ChannelFault::unknown_key);
  };
  CHECK(looked_into(1, 1'100) == 1'000);
  CHECK(looked_into(20, 110) == 2'000);
}

TEST_CASE(
    "where tokens let in, strangers get 20 of them verified a second from a prefix, 200 together, and keep no known key out") {
  SiteKeys site = site_keys();
  site.issuers.push_back(public_of(secret_of(99)));
  for (const auto& [hosts, each] : {std::pair{1, 50}, {20, 15}}) {
    ChannelPair pair(site);
    for (int k = 0; k < hosts * each; ++k)
      shake_hands_as(pair, client_keys(kStrangerSeed), static_cast<std::uint64_t>(1000 + k),
                     address_of(1 + k % hosts, 5000 + k / hosts));
    CHECK(pair.server.counts().of(ChannelFault::unknown_key) == static_cast<std::uint64_t>(std::min(hosts * 20, 200)));
    pair.client = ClientChannel(client_keys(), 5, seeded(7), pair.now);
    CHECK(pair.join() != 0);
  }
}

TEST_CASE("whoever claims a key that the server knows gets 20 handshakes a second computed, and keeps out nobody but that key") {
  SiteKeys site = site_keys();
  site.stations[public_of(secret_of(kStrangerSeed))] = rights_of("OR 4");
  ChannelPair pair(site);
  for (int k = 0; k < 50; ++k)
    shake_hands_as(pair, client_keys(kStrangerSeed), static_cast<std::uint64_t>(1000 + k), address_of(1 + k, 5000));
  CHECK(pair.server.counts().answers == 20);
  CHECK(pair.server.counts().of(ChannelFault::limit) == 30);
  pair.client = ClientChannel(client_keys(), 5, seeded(7), pair.now);
  CHECK(pair.join() != 0);
}

TEST_CASE("who plays recorded handshakes of a key again uses up nothing of what that key may ask for") {
  ChannelPair pair;
  std::vector<Datagram> recorded;
  for (int k = 0; k < 8; ++k) {  // the first and seven with new keys
    const auto asking = pair.from_client();
    for (const Datagram& datagram : asking) pair.to_server(datagram);
    for (const Datagram& cookie : pair.from_server()) pair.to_client(cookie);
    for (const Datagram& init : pair.from_client()) {
      recorded.push_back(init);
      pair.to_server(init);
    }
    for (const Datagram& resp : pair.from_server()) pair.to_client(resp);
    REQUIRE(pair.to_server(pair.sealed("hello")));
    pair.now += Micros{120'000'000};
  }
  REQUIRE(recorded.size() == 8);
  const ChannelAddress home = pair.from;
  for (int k = 0; k < 400; ++k) {
    Datagram init = recorded[static_cast<std::size_t>(k) % recorded.size()];
    pair.from = address_of(9, 5000);
    pair.to_server(init);
    for (const Datagram& cookie : pair.from_server())
      std::copy_n(cookie.begin() + kHeadBytes, kMacBytes, init.end() - static_cast<long>(kMacBytes));
    pair.to_server(init);
    pair.from_server();
    pair.now += Micros{2'000};
  }
  CHECK(pair.server.counts().of(ChannelFault::stale) > 300);
  pair.from = home;
  pair.client = ClientChannel(client_keys(), 5, seeded(7), pair.now);
  CHECK(pair.join() != 0);
}

TEST_CASE("strangers who use up all handshakes, elsewhere or at a session's own host, keep no session from its next keys") {
  for (const bool at_home : {false, true}) {
    ChannelPair pair;
    const ChannelPeer peer = pair.join();
    REQUIRE(pair.to_client(pair.sealed_by_server(peer, "welcome")) > 0);
    const ClientChannel station = pair.client;
    const ChannelAddress home = pair.from;
    pair.now += Micros{120'000'000};
    const int strangers = 2'400, computed = at_home ? kLooksPrefix : kLooksAll;
    for (std::uint64_t k = 0; k < strangers; ++k) {
      const int n = static_cast<int>(k);
      shake_hands_as(pair, client_keys(kStrangerSeed), 1000 + k,
                     at_home ? address_of(1, 20'000 + n) : address_of(10 + n / 10, 5000));
    }
    INFO((at_home ? "at home" : "elsewhere"));
    REQUIRE(pair.server.counts().of(ChannelFault::limit) == static_cast<std::uint64_t>(strangers - computed));
    pair.client = station;
    pair.from = home;
    CHECK(pair.join() == peer);
    CHECK(pair.client.counts().handshakes == 2);
  }
}

TEST_CASE("one key has its streams and a few more, keeps nobody else out, and recorded handshakes of it count for nothing") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ClientChannel station = pair.client;
  const ChannelAddress home = pair.from;
  pair.now += ServerChannel::kSilent + Micros{1'000'000};
  for (std::uint64_t k = 0; k < 60; ++k) {  // Inits of many lives of this station
    pair.now += Micros{60'000};
    shake_hands_as(pair, client_keys(), 300 + k, address_of(60 + static_cast<int>(k) % 10, 5000));
  }
  CHECK(pair.server.counts().of(ChannelFault::full) == 0);
  const auto goes_on = [&] {
    const ClientChannel other = std::exchange(pair.client, station);
    const auto opened = pair.to_server(pair.sealed("still here"));
    REQUIRE(opened);
    CHECK(opened->peer == peer);
    pair.client = other;
  };
  goes_on();
  int joined = 1;
  for (std::uint64_t k = 0; k < 40; ++k) {
    pair.now += Micros{60'000};
    pair.from = home;
    pair.client = ClientChannel(client_keys(), 5, seeded(400 + k), pair.now);
    joined += pair.join() != 0;
  }
  CHECK(joined == kStreamsUsual + ServerChannel::kSpareSessions);
  CHECK(pair.server.counts().of(ChannelFault::full) > 0);
  pair.now += ServerChannel::kSilent + Micros{1};
  pair.client = ClientChannel(client_keys(), 5, seeded(999), pair.now);
  CHECK(pair.join() != 0);  // replaces one that has gone
}
