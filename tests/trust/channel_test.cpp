// The trust channel from both ends: what gets through, and that nothing else does.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// One datagram of each kind that a join sends, in the order sent: Init, Cookie, Init, Resp, Data.
struct Recorded {
  ChannelPair pair;
  Datagram asking, cookie, init, resp, data;
  Recorded() {
    asking = pair.from_client().at(0);
    pair.to_server(asking);
    cookie = pair.from_server().at(0);
    pair.to_client(cookie);
    init = pair.from_client().at(0);
    pair.to_server(init);
    resp = pair.from_server().at(0);
  }
};

}  // namespace

TEST_CASE("a station that the server knows has a session after two round trips, and data goes both ways") {
  ChannelPair pair;
  REQUIRE(pair.shake_hands());
  CHECK(pair.server.counts().sessions == 0);  // it has not spoken yet
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
  pair.server.forget(1);  // what Recorded began
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
  // The impostor shakes hands with the same client key; its answer, made out to the genuine client's index, is of no use.
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
  CHECK(genuine.shake_hands());  // and has not spoiled the handshake
}

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
    if (bit % 8 != bit / 8 % 8) continue;  // one bit a byte: each costs Diffie-Hellman
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
    CHECK(answers[0] == seen.resp);  // the same bytes: nothing was computed, and they are of no use to anybody
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
  // With the index that the receiver expects, and whoever could do that, the direction's key does not fit.
  Datagram turned = up;
  std::copy_n(down.begin() + 4, 4, turned.begin() + 4);
  CHECK(pair.to_client(turned) == 0);
  CHECK(pair.client.counts().forged == 1);
  Datagram back = down;
  std::copy_n(up.begin() + 4, 4, back.begin() + 4);
  back[8] = 77;  // a counter that has not come
  CHECK_FALSE(pair.to_server(back));
  CHECK(pair.server.counts().of(ChannelFault::forged) == 1);
}

TEST_CASE("a datagram that 2047 others have overtaken is taken once, one that 2048 have is not") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  const Datagram early = pair.sealed("early"), late = pair.sealed("late");
  std::vector<Datagram> others;
  for (int k = 0; k < 2047; ++k) others.push_back(pair.sealed("x"));
  for (const Datagram& other : others) REQUIRE(pair.to_server(other));
  CHECK_FALSE(pair.to_server(early));  // 2048 newer ones: late and the others
  CHECK(pair.to_server(late));
  CHECK_FALSE(pair.to_server(late));
}

TEST_CASE("the replay window says what a list of all that came says") {
  Random random(11);
  ReplayWindow window;
  std::set<std::uint64_t> came;
  std::uint64_t newest = 0;
  for (int k = 0; k < 60'000; ++k) {
    const std::uint64_t jump = random.chance(0.01) ? 5000 : random.chance(0.2) ? 300 : 3;
    const std::uint64_t reach = random.chance(0.1) ? 4 * kReplayWindow : 64;
    const std::uint64_t up = newest + random.bits() % jump, back = random.bits() % reach;
    const std::uint64_t counter = up > back ? up - back : 0;
    const bool young = came.empty() || counter + kReplayWindow > *came.rbegin();
    REQUIRE(window.is_fresh(counter) == (young && !came.contains(counter)));
    if (!window.is_fresh(counter)) continue;
    CHECK(window.mark(counter) == (came.empty() || counter > *came.rbegin()));
    came.insert(counter);
    newest = *came.rbegin();
  }
}

TEST_CASE("a session gets new keys every two minutes and loses nothing but what the link loses, at 30 % loss") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  REQUIRE(peer != 0);
  Random random(5);
  int sent = 0, opened = 0, back = 0;
  const auto lost = [&] { return random.chance(0.3); };
  for (const Micros end = pair.now + Micros{600'000'000}; pair.now < end; pair.now += Micros{50'000}) {
    for (const Datagram& datagram : pair.from_client())
      if (!lost()) pair.to_server(datagram);
    for (const Datagram& datagram : pair.from_server())
      if (!lost()) pair.to_client(datagram);
    pair.server.tick(pair.now);
    const Datagram up = pair.sealed("sample"), down = pair.sealed_by_server(peer, "patch");
    REQUIRE(!up.empty());
    REQUIRE(!down.empty());
    if (!lost()) {
      ++sent;
      const auto got = pair.to_server(up);
      REQUIRE(got);
      REQUIRE(got->peer == peer);
      ++opened;
    }
    if (!lost()) back += pair.to_client(down) > 0;
  }
  CHECK(opened == sent);
  CHECK(back > 8000);
  CHECK(pair.client.counts().handshakes >= 5);
  CHECK(pair.server.sessions() == 1);
}

TEST_CASE("keys that were replaced open what is under way for ten seconds, and nothing later") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  REQUIRE(pair.to_client(pair.sealed_by_server(peer, "welcome")) > 0);
  const Datagram soon = pair.sealed("soon"), later = pair.sealed("later");
  const Datagram down_soon = pair.sealed_by_server(peer, "soon"), down_later = pair.sealed_by_server(peer, "later");
  pair.now += Micros{120'000'000};
  REQUIRE(pair.shake_hands());
  REQUIRE(pair.client.counts().handshakes == 2);
  REQUIRE(pair.to_server(pair.sealed("new keys")));
  pair.now += Micros{9'900'000};
  CHECK(pair.to_server(soon));
  CHECK(pair.to_client(down_soon) > 0);
  pair.now += Micros{200'000};
  pair.from_client();
  CHECK_FALSE(pair.to_server(later));
  CHECK(pair.to_client(down_later) == 0);
}

TEST_CASE("keys that nobody used yet are not replaced for their age, and so what is under way comes to both ends") {
  ChannelPair pair(site_keys(), client_keys(), 7, {.rekey = Micros{1'000'000}});
  const ChannelPeer peer = pair.join();
  REQUIRE(pair.to_client(pair.sealed_by_server(peer, "welcome")) > 0);
  pair.now += Micros{1'000'000};
  REQUIRE(pair.shake_hands());
  REQUIRE(pair.client.counts().handshakes == 2);
  pair.now += Micros{2'000'000};
  const Datagram up = pair.sealed("with the new keys"), down = pair.sealed_by_server(peer, "with the old ones");
  pair.shake_hands();
  CHECK(pair.client.counts().handshakes == 2);
  CHECK(pair.to_server(up));
  CHECK(pair.to_client(down) > 0);
  REQUIRE(pair.to_client(pair.sealed_by_server(peer, "with the new ones")) > 0);
  pair.shake_hands();
  CHECK(pair.client.counts().handshakes == 3);
}

TEST_CASE("keys of 180 s are of no use at either end") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  pair.now += Micros{179'900'000};
  CHECK(pair.to_server(pair.sealed("still")));
  CHECK(pair.to_client(pair.sealed_by_server(peer, "still")) > 0);
  const Datagram up = pair.sealed("too late"), down = pair.sealed_by_server(peer, "too late");
  pair.now += Micros{200'000};
  CHECK(pair.sealed("none").empty());
  CHECK(pair.sealed_by_server(peer, "none").empty());
  CHECK_FALSE(pair.to_server(up));
  CHECK(pair.to_client(down) == 0);
  pair.server.tick(pair.now);
  CHECK(pair.server.take_ended() == std::vector<ChannelPeer>{peer});
}

TEST_CASE("the answers follow the newest datagram that opens, wherever it comes from, and no other") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, moved = address_of(9, 999);
  const Datagram older = pair.sealed("older"), newer = pair.sealed("newer");
  pair.from = moved;
  Datagram forged = newer;
  forged.back() ^= 1;
  CHECK_FALSE(pair.to_server(forged));
  pair.sealed_by_server(peer, "patch");
  CHECK(pair.to == home);
  CHECK(pair.to_server(newer));
  pair.sealed_by_server(peer, "patch");
  CHECK(pair.to == moved);
  pair.from = home;
  CHECK(pair.to_server(older));  // taken, but overtaken
  pair.sealed_by_server(peer, "patch");
  CHECK(pair.to == moved);
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

TEST_CASE("a prefix gets 20 handshakes a second computed, all together 200") {
  const auto computed = [](int hosts, int each) {
    ChannelPair pair;
    int number = 0;
    for (int k = 0; k < each; ++k)
      for (int host = 0; host < hosts; ++host) {
        pair.client = ClientChannel(client_keys(kStrangerSeed), 5, seeded(static_cast<std::uint64_t>(1000 + number++)), pair.now);
        pair.from = address_of(host, 5000 + k);
        pair.shake_hands();
      }
    const auto& counts = pair.server.counts();
    CHECK(counts.of(ChannelFault::limit) + counts.of(ChannelFault::unknown_key) == static_cast<std::uint64_t>(hosts * each));
    return counts.of(ChannelFault::unknown_key);
  };
  CHECK(computed(1, 50) == 20);
  CHECK(computed(20, 15) == 200);
}

TEST_CASE("strangers who use up all handshakes keep no session from its next keys") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  REQUIRE(pair.to_client(pair.sealed_by_server(peer, "welcome")) > 0);
  const ClientChannel station = pair.client;
  const ChannelAddress home = pair.from;
  pair.now += Micros{120'000'000};
  for (int k = 0; k < 300; ++k) {
    pair.client = ClientChannel(client_keys(kStrangerSeed), 5, seeded(static_cast<std::uint64_t>(1000 + k)), pair.now);
    pair.from = address_of(50 + k / 10, 5000);
    pair.shake_hands();
  }
  REQUIRE(pair.server.counts().of(ChannelFault::limit) == 100);
  pair.client = station;
  pair.from = home;
  CHECK(pair.join() == peer);
  CHECK(pair.client.counts().handshakes == 2);
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

TEST_CASE("a key that is taken out ends its sessions, others go on") {
  SiteKeys site = site_keys();
  const PublicKey other = public_of(secret_of(kStrangerSeed));
  site.stations[other] = rights_of("OR 4");
  ChannelPair pair(site);
  const ChannelPeer first = pair.join();
  const ClientChannel first_client = pair.client;
  pair.client = ClientChannel(client_keys(kStrangerSeed), 5, seeded(44), pair.now);
  const ChannelPeer second = pair.join();
  REQUIRE(second != 0);
  site.stations.erase(other);
  pair.server.change_keys(site);
  CHECK(pair.server.take_ended() == std::vector<ChannelPeer>{second});
  CHECK_FALSE(pair.to_server(pair.sealed("still here?")));
  CHECK(!pair.sealed_by_server(second, "goodbye").empty());  // so that it can be told
  pair.server.forget(second);
  CHECK(pair.sealed_by_server(second, "goodbye").empty());
  pair.client = first_client;
  CHECK(pair.to_server(pair.sealed("I am"))->peer == first);
}

TEST_CASE("a key whose rights changed begins anew") {
  SiteKeys site = site_keys();
  ChannelPair pair(site);
  const ChannelPeer peer = pair.join();
  pair.server.change_keys(site);
  CHECK(pair.server.take_ended().empty());
  site.stations.begin()->second.rooms = {"liver"};
  pair.server.change_keys(site);
  CHECK(pair.server.take_ended() == std::vector<ChannelPeer>{peer});
}

TEST_CASE("one key cannot take the place of all others") {
  ChannelPair pair;
  int joined = 0;
  for (int k = 0; k < 40; ++k) {
    pair.now += Micros{60'000};
    pair.client = ClientChannel(client_keys(), 5, seeded(static_cast<std::uint64_t>(300 + k)), pair.now);
    joined += pair.join() != 0;
  }
  CHECK(joined == kStreamsUsual + ServerChannel::kSpareSessions);
  CHECK(pair.server.counts().of(ChannelFault::full) > 0);
  pair.now += ServerChannel::kSilent + Micros{1};
  pair.client = ClientChannel(client_keys(), 5, seeded(999), pair.now);
  CHECK(pair.join() != 0);  // in the place of one that has gone
}
