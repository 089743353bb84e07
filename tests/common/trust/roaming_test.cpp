// The address of a session: it follows a client whose NAT binding changed, but no forged sender.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// Address to which a patch is sent now.
ChannelAddress served(ChannelPair& pair, ChannelPeer peer) {
  REQUIRE(!pair.sealed_by_server(peer, "patch").empty());
  return pair.to;
}

/// As large as the smallest datagram of a client with data.
const std::string kSamples(100, 's');

/// Delivers everything that the server's channel has for this address to the client, and its answers from there to the server.
void exchange(ChannelPair& pair, const ChannelAddress& at) {
  for (const Datagram& question : pair.from_server())
    if (pair.to == at) pair.to_client(question);
  pair.from = at;
  for (const Datagram& answer : pair.from_client()) pair.to_server(answer);
}

/// A client behind a NAT that the test moves, with a delay; datagrams to an address that it no longer has get lost.
struct Behind {
  Behind(std::uint64_t seed, Micros way, double loss) : random(seed), way_(way), loss_(loss) {}

  struct Flight {
    Micros at;
    bool up;
    ChannelAddress address;
    Datagram bytes;
  };
  void send(bool up, const ChannelAddress& address, Datagram bytes) {
    if (random.chance(loss_)) return;
    flights.push_back({pair.now + way_, up, address, std::move(bytes)});
  }
  void arrive() {
    const auto due = [&](const Flight& flight) { return flight.at <= pair.now; };
    for (const Flight& flight : flights) {
      if (!due(flight)) continue;
      if (flight.up) {
        pair.from = flight.address;
        pair.to_server(flight.bytes);
      } else if (flight.address == home) {
        got += pair.to_client(flight.bytes) > 0;
      }
    }
    std::erase_if(flights, due);
  }
  /// One millisecond; every tenth has samples and every fiftieth a patch.
  void step(ChannelPeer peer) {
    constexpr Micros kMs{1'000};
    arrive();
    for (Datagram& datagram : pair.from_client()) send(true, home, std::move(datagram));
    if (pair.now / kMs % 10 == 0) send(true, home, pair.sealed(kSamples));
    Datagram out(kMaxSealedBytes);
    while (const std::size_t size = pair.server.emit(out, pair.to))
      send(false, pair.to, {out.begin(), out.begin() + static_cast<long>(size)});
    Datagram patch = pair.sealed_by_server(peer, "patch");
    now_served = pair.to;
    if (pair.now / kMs % 50 == 0) send(false, now_served, std::move(patch));
    pair.now += kMs;
  }

  ChannelPair pair;
  ChannelAddress home = pair.from, now_served = home;
  Random random;
  std::vector<Flight> flights;
  int got = 0;

 private:
  Micros way_;
  double loss_;
};

}  // namespace

TEST_CASE("a stream that a key's holder aims at an address that never answers stays where it is, and less goes there than came") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, victim = address_of(77, 53);
  std::size_t from_victim = 0, to_victim = 0;
  for (int k = 0; k < 2'000; ++k) {
    pair.now += Micros{5'000};
    pair.from = victim;
    const Datagram forged_sender = pair.sealed(kSamples);
    from_victim += forged_sender.size();
    const auto opened = pair.to_server(forged_sender);
    REQUIRE(opened);
    CHECK_FALSE(opened->shown);
    for (const Datagram& answer : pair.from_server())
      if (pair.to == victim) to_victim += answer.size();
    const Datagram patch = pair.sealed_by_server(peer, std::string(1000, 'p'));
    if (pair.to == victim) to_victim += patch.size();
    REQUIRE(to_victim <= from_victim);
    CHECK(pair.to == home);
  }
  CHECK(to_victim > 0);
  CHECK(pair.server.counts().moves == 0);
}

TEST_CASE("a session begins where its handshake was, and the first data from elsewhere aim it nowhere") {
  ChannelPair pair;
  REQUIRE(pair.shake_hands());
  const ChannelAddress home = pair.from;
  pair.from = address_of(77, 53);
  const auto opened = pair.to_server(pair.sealed(kSamples));
  REQUIRE(opened);
  CHECK(served(pair, opened->peer) == home);
}

TEST_CASE("an address is served as soon as it has answered, and not again what was overtaken") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, moved = address_of(9, 999);
  const Datagram older = pair.sealed("older"), newer = pair.sealed(kSamples);
  pair.from = moved;
  Datagram forged = newer;
  forged.back() ^= 1;
  CHECK_FALSE(pair.to_server(forged));
  CHECK(pair.from_server().empty());
  CHECK(pair.to_server(newer));
  CHECK(served(pair, peer) == home);
  exchange(pair, moved);
  CHECK(served(pair, peer) == moved);
  CHECK(pair.server.counts().moves == 1);
  pair.from = home;
  CHECK(pair.to_server(older));  // accepted, but overtaken
  CHECK(served(pair, peer) == moved);
}

TEST_CASE("datagrams too small for a question get none") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  pair.from = address_of(9, 999);
  REQUIRE(pair.to_server(pair.sealed(std::string(kPathBytes - kDataOverhead - 1, 's'))));
  CHECK(pair.from_server().empty());
  REQUIRE(pair.to_server(pair.sealed(std::string(kPathBytes - kDataOverhead, 's'))));
  CHECK(pair.from_server().size() == 1);
}

TEST_CASE("a rebinding under 30 % loss, the old address dead at once, costs a few round trips and no session") {
  constexpr Micros kWay{50'000};
  std::vector<Micros> took;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Behind behind(seed, kWay, 0.3);
    const ChannelPeer peer = behind.pair.join();
    const Micros move = behind.pair.now + Micros{200'000};
    while (behind.pair.now < move) behind.step(peer);
    behind.home = address_of(9, 999);
    while (behind.now_served != behind.home && behind.pair.now < move + Micros{3'000'000}) behind.step(peer);
    took.push_back(behind.pair.now - move);
    behind.got = 0;
    for (int k = 0; k < 1'000; ++k) behind.step(peer);
    CHECK(behind.got > 5);
    CHECK(behind.pair.client.counts().handshakes == 1);
    CHECK(behind.pair.server.sessions() == 1);
  }
  std::sort(took.begin(), took.end());
  // A datagram, the question and the answer: three delays, plus 20 ms for each loss.
  CHECK(took[took.size() / 2] < 4 * kWay);
  CHECK(took.back() < 10 * kWay);
}

TEST_CASE("what is sent again from forged addresses moves nothing, is asked nothing and keeps the true move from nothing") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, moved = address_of(9, 999);
  std::vector<Datagram> seen;
  for (int k = 0; k < 100; ++k) {
    seen.push_back(pair.sealed(kSamples));
    REQUIRE(pair.to_server(seen.back()));
  }
  const auto replay = [&] {
    for (int host = 20; host < 200; ++host) {
      pair.from = address_of(host, 1234);
      CHECK_FALSE(pair.to_server(seen[static_cast<std::size_t>(host) % seen.size()]));
    }
  };
  replay();
  CHECK(pair.from_server().empty());
  CHECK(served(pair, peer) == home);
  pair.from = moved;
  REQUIRE(pair.to_server(pair.sealed(kSamples)));
  replay();
  const auto question = pair.from_server();
  REQUIRE(question.size() == 1);
  CHECK(pair.to == moved);
  REQUIRE(pair.to_client(question[0]) == 0);
  const auto answer = pair.from_client();
  REQUIRE(answer.size() == 1);
  replay();
  pair.from = moved;
  pair.to_server(answer[0]);
  CHECK(served(pair, peer) == moved);
  for (int host = 20; host < 200; ++host) {  // the answer as well
    pair.from = address_of(host, 1234);
    pair.to_server(answer[0]);
  }
  CHECK(pair.from_server().empty());
  CHECK(served(pair, peer) == moved);
  CHECK(pair.server.counts().paths == 1);
}

TEST_CASE("of two addresses that a client has in turn the one with the newest counter is served, and each is asked once") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress first = pair.from, second = address_of(9, 999);
  for (int k = 0; k < 100; ++k) {
    pair.now += Micros{10'000};
    const ChannelAddress& at = k % 2 == 0 ? first : second;
    pair.from = at;
    REQUIRE(pair.to_server(pair.sealed(kSamples)));
    for (const Datagram& question : pair.from_server()) {
      CHECK(pair.to == second);
      pair.to_client(question);
    }
    pair.from = first;  // from any address
    for (const Datagram& answer : pair.from_client()) pair.to_server(answer);
    pair.from = at;
    REQUIRE(pair.to_server(pair.sealed(kSamples)));
    CHECK(served(pair, peer) == at);
  }
  CHECK(pair.server.counts().paths == 1);
}

TEST_CASE("an address whose answer comes after the client went on to another is not served for it") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, between = address_of(9, 999);
  pair.from = between;
  REQUIRE(pair.to_server(pair.sealed(kSamples)));
  for (const Datagram& question : pair.from_server()) pair.to_client(question);
  const auto answer = pair.from_client();
  REQUIRE(answer.size() == 1);
  pair.from = home;
  REQUIRE(pair.to_server(pair.sealed(kSamples)));
  pair.to_server(answer[0]);
  CHECK(served(pair, peer) == home);
}

TEST_CASE("no flipped bit of a question or an answer is taken, and none that is late, of other keys or about another address") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, moved = address_of(9, 999);
  const auto ask = [&] {
    pair.now += ServerChannel::kAskEvery;
    pair.from = moved;
    REQUIRE(pair.to_server(pair.sealed(kSamples)));
    return pair.from_server().back();  // flipped ones got their hints
  };
  const Datagram question = ask();
  REQUIRE(question.size() == kPathBytes);
  for (std::size_t bit = 0; bit < 8 * question.size(); ++bit) {
    Datagram bad = question;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    REQUIRE(pair.to_client(bad) == 0);
    REQUIRE(pair.from_client().empty());
  }
  for (const std::size_t size : {std::size_t{0}, kPathBytes - 1, kPathBytes + 1}) {
    Datagram bad = question;
    bad.resize(size);
    REQUIRE(pair.to_client(bad) == 0);
    REQUIRE(pair.from_client().empty());
  }
  pair.to_client(question);
  const Datagram answer = pair.from_client().at(0);
  for (std::size_t bit = 0; bit < 8 * answer.size(); ++bit) {
    Datagram bad = answer;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    pair.to_server(bad);
    REQUIRE(served(pair, peer) == home);
  }
  pair.now += 2 * ServerChannel::kPathLasts;
  pair.to_server(answer);
  CHECK(served(pair, peer) == home);

  pair.to_client(ask());
  const Datagram of_old_keys = pair.from_client().at(0);
  pair.now += Micros{120'000'000};
  pair.to_client(pair.sealed_by_server(peer, "so that the keys were used"));
  pair.from = home;
  REQUIRE(pair.join() == peer);
  pair.from = moved;
  pair.to_server(of_old_keys);
  REQUIRE(pair.to_server(pair.sealed("newest")));
  CHECK(served(pair, peer) == home);

  pair.to_client(ask());
  pair.to_server(pair.from_client().at(0));
  CHECK(served(pair, peer) == moved);
}

TEST_CASE("an address is believed until new keys come, and those begin where their own handshake was") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress home = pair.from, moved = address_of(9, 999);
  pair.to_client(pair.sealed_by_server(peer, "welcome"));
  pair.from = moved;
  REQUIRE(pair.to_server(pair.sealed(kSamples)));
  exchange(pair, moved);
  REQUIRE(served(pair, peer) == moved);
  pair.now += Micros{120'000'000};
  pair.from = home;  // genuine: datagrams from `moved` have a forged sender by now
  REQUIRE(pair.shake_hands());
  pair.from = moved;
  REQUIRE(pair.to_server(pair.sealed(kSamples)));
  CHECK(served(pair, peer) == home);
}

TEST_CASE("a client that answers no question is followed by its next handshake, which its silence brings about") {
  ChannelPair pair;
  const ChannelPeer peer = pair.join();
  const ChannelAddress moved = address_of(9, 999);
  pair.from = moved;
  bool followed = false;
  for (int k = 0; k < 400 && !followed; ++k) {
    pair.now += Micros{10'000};
    REQUIRE(pair.to_server(pair.sealed(kSamples)));
    for (const Datagram& answer : pair.from_server())
      if (pair.to == moved && answer.size() != kPathBytes) pair.to_client(answer);  // sent before the questions
    for (const Datagram& datagram : pair.from_client()) pair.to_server(datagram);
    followed = served(pair, peer) == moved;
  }
  CHECK(followed);
  CHECK(pair.client.counts().handshakes == 2);
  CHECK(pair.server.sessions() == 1);
}

TEST_CASE("questions that never come through do not keep a client from the handshake that its silence asks for") {
  ChannelPair pair;
  REQUIRE(pair.join() != 0);
  pair.from = address_of(9, 999);
  for (int k = 0; k < 400 && pair.client.counts().handshakes == 1; ++k) {
    pair.now += Micros{10'000};
    REQUIRE(pair.to_server(pair.sealed(kSamples)));
    for (const Datagram& answer : pair.from_server()) pair.to_client(answer);
    for (const Datagram& datagram : pair.from_client())
      if (datagram.size() != kPathBytes) pair.to_server(datagram);
  }
  CHECK(pair.client.counts().handshakes == 2);
}
