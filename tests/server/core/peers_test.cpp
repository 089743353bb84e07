#include "server/io/peers.hpp"

#include <asio/ip/address.hpp>
#include <catch2/catch.hpp>
#include <set>

using namespace palpate;

namespace {

UdpEndpoint at(std::uint16_t port, const char* address = "127.0.0.1") { return {asio::ip::make_address(address), port}; }

}  // namespace

TEST_CASE("an address keeps its number for ever and is found by it until strangers are forgotten") {
  Peers peers(repeatable(1));
  const PeerId a = peers.id_of(at(1000)), b = peers.id_of(at(1001));
  CHECK(a != b);
  REQUIRE(peers.address_of(b));
  CHECK(*peers.address_of(b) == at(1001));
  CHECK(peers.address_of(12345) == nullptr);
  peers.forget_strangers([](PeerId) { return false; });
  CHECK(peers.address_of(b) == nullptr);
  CHECK(peers.id_of(at(1000)) == a);
}

TEST_CASE("addresses, ports and families are told apart, and another process numbers them otherwise") {
  Peers peers(repeatable(1)), others(repeatable(2));
  std::set<PeerId> ids;
  for (const char* address : {"127.0.0.1", "127.0.0.2", "::1", "::2", "::ffff:127.0.0.1"})
    for (const int port : {1, 2, 256, 512})
      for (Peers* of : {&peers, &others}) ids.insert(of->id_of(at(static_cast<std::uint16_t>(port), address)));
  CHECK(ids.size() == 2 * 5 * 4);
}

TEST_CASE("a flood of senders leaves nothing behind, and those who are served are found all the while") {
  Peers peers(repeatable(1));
  const PeerId station = peers.id_of(at(1));
  const auto serves = [station](PeerId id) { return id == station; };
  for (int round = 0; round < 300; ++round) {
    for (std::uint16_t port = 2; port < 258; ++port) peers.id_of(at(static_cast<std::uint16_t>(port + 200 * round)));
    CHECK(peers.size() <= 257);
    peers.forget_strangers(serves);
    CHECK(peers.size() == 1);
    CHECK(*peers.address_of(station) == at(1));
  }
}

TEST_CASE("those who were served once are forgotten before they are many") {
  Peers peers(repeatable(1));
  for (std::uint16_t port = 1; port < 5000; ++port) {
    const PeerId now_there = peers.id_of(at(port));
    peers.forget_strangers([now_there](PeerId id) { return id == now_there; });
    CHECK(peers.size() <= 70);
  }
}
