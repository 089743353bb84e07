#include "server/io/peers.hpp"

#include <asio/ip/address.hpp>
#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

UdpEndpoint at(std::uint16_t port) { return {asio::ip::make_address("127.0.0.1"), port}; }

}  // namespace

TEST_CASE("an address keeps its number and is found by it") {
  Peers peers;
  const auto a = peers.id_of(at(1000), 1s), b = peers.id_of(at(1001), 1s);
  REQUIRE(a);
  REQUIRE(b);
  CHECK(*a != *b);
  CHECK(peers.id_of(at(1000), 9s) == a);
  CHECK(*peers.address_of(*b) == at(1001));
  CHECK(peers.address_of(12345) == nullptr);
}

TEST_CASE("a flood of senders does not push out those who are there, and is forgotten later") {
  Peers peers;
  const auto station = peers.id_of(at(1), 1s);
  for (std::uint16_t port = 2; port <= Peers::kMost; ++port) REQUIRE(peers.id_of(at(port), 1s));
  CHECK_FALSE(peers.id_of(at(60'000), 2s));
  CHECK(peers.id_of(at(1), 10s) == station);
  CHECK(peers.id_of(at(60'000), 12s));
  CHECK(peers.id_of(at(1), 12s) == station);
  CHECK(peers.address_of(*station + 1) == nullptr);
}
