// Decides which of two sessions of one key is the newer, as the rooms ask.
#include <catch2/catch.hpp>

#include "server/trust/server_trust.hpp"
#include "tests/common/trust/channel_pair.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct Site {
  Micros now{1'000'000};
  ServerTrust trust{keys(), seeded(7), [] { return std::int64_t{1'800'000'000}; }};
  std::vector<Datagram> sent;  ///< to the server

  static SiteKeys keys() {
    SiteKeys site = site_keys();
    site.stations[public_of(secret_of(kStrangerSeed))] = rights_of("OR 4");
    return site;
  }
  void take(const Datagram& datagram, int host) {
    sent.push_back(datagram);
    trust.take(std::as_bytes(std::span(datagram)), address_of(host, 4711), now);
  }
  /// Runs a program with this key that sends something; returns the number of its session.
  ChannelPeer join(std::uint64_t key, int host, std::uint64_t seed) {
    ClientChannel client(client_keys(key), 5, seeded(seed), now);
    Datagram out(kMaxSealedBytes), answer(kMaxSealedBytes), plain(kMaxSealedBytes);
    for (int round = 0; round < 2; ++round) {
      client.tick(now);
      while (const std::size_t size = client.emit(out, now)) take({out.begin(), out.begin() + static_cast<long>(size)}, host);
      for (ChannelAddress to; const std::size_t size = trust.channel().emit(answer, to);)
        client.take({answer.data(), size}, now, plain);
    }
    std::vector<std::byte> hello(kMaxDatagramBytes);
    Message message;
    message.body = Hello{"OR 3", Role::haptic, Scheme::port, 0, ""};
    hello.resize(encode(message, hello));
    out.resize(client.seal(octets(std::span<const std::byte>(hello)), out, now));
    sent.push_back(out);
    const auto letter = trust.take(std::as_bytes(std::span(out)), address_of(host, 4711), now);
    return letter ? letter->from : 0;
  }
};

}  // namespace

TEST_CASE("sessions of one key are known by it, those of others by theirs, and those that are gone by none") {
  Site site;
  const ChannelPeer first = site.join(kStationSeed, 1, 11), other = site.join(kStrangerSeed, 2, 12),
                    second = site.join(kStationSeed, 3, 13);
  REQUIRE((first != 0 && other != 0 && second != 0));
  CHECK(first < second);
  CHECK_FALSE(site.trust.key_of(first).empty());
  CHECK(site.trust.key_of(second) == site.trust.key_of(first));
  CHECK(site.trust.key_of(other) != site.trust.key_of(first));
  CHECK(site.trust.key_of(second + 1).empty());  // nobody has that number yet
  site.trust.forget(first);
  CHECK(site.trust.key_of(first).empty());
}

TEST_CASE("a whole join that is sent again makes no session, so nobody succeeds by it") {
  Site site;
  const ChannelPeer first = site.join(kStationSeed, 1, 11);
  const auto recorded = site.sent;
  const auto opened = site.trust.channel().counts().opened;
  for (const int host : {1, 2})
    for (const Datagram& datagram : recorded) {
      site.now += Micros{300'000};
      CHECK_FALSE(site.trust.take(std::as_bytes(std::span(datagram)), address_of(host, 4711), site.now));
    }
  CHECK(site.trust.channel().counts().opened == opened);
  CHECK(site.join(kStationSeed, 3, 13) == first + 1);
}
