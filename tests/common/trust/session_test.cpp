// A session of the trust channel over time: its window, keys, address and end.
#include <catch2/catch.hpp>

#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

TEST_CASE("a datagram that 2047 others have overtaken is taken once, one that 2048 have is not") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  const Datagram early = pair.sealed("early"), late = pair.sealed("late");
  std::vector<Datagram> others;
  for (int k = 0; k < 2047; ++k) others.push_back(pair.sealed("x"));
  for (const Datagram& other : others) REQUIRE(pair.to_server(other));
  CHECK_FALSE(pair.to_server(early));  // too old: 2048 newer ones came, `late` and the others
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
  CHECK(!pair.sealed_by_server(second, "goodbye").empty());  // so that the goodbye can be sent
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
