#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "common/io/channel_endpoint.hpp"
#include "common/io/endpoint.hpp"

using namespace palpate;

TEST_CASE("HOST:PORT splits into its parts, an IPv6 address in brackets") {
  const HostPort name = parse_host_port("--server", "lab.example:4711");
  CHECK(name.host == "lab.example");
  CHECK(name.port == 4711);
  const HostPort six = parse_host_port("--server", "[::1]:0");
  CHECK(six.host == "::1");
  CHECK(six.port == 0);
}

TEST_CASE("what is no HOST:PORT is refused with the flag, the text and what was expected") {
  for (const char* text :
       {"", "host", ":80", "host:", "host:-1", "host:65536", "host:80x", "host: 80", "::1:80", "[]:80", "[::1:80"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(parse_host_port("--server", text), InputError);
  }
  CHECK_THROWS_WITH(parse_host_port("--server", "host:99999"), Catch::StartsWith("--server: ") && Catch::Contains("99999") &&
                                                                   Catch::Contains("expected a port from 0 to 65535"));
}

TEST_CASE("addresses resolve without a resolver and are written as they are read") {
  CHECK(to_string(resolve_udp("--to", "127.0.0.1:4711")) == "127.0.0.1:4711");
  CHECK(to_string(resolve_udp("--to", "[::1]:4711")) == "[::1]:4711");
  CHECK_THROWS_AS(resolve_udp("--to", "no-such-host.invalid:1"), InputError);
}

TEST_CASE("a port in use is refused by its number") {
  asio::io_context io;
  const UdpSocket first = bind_udp(io, "--listen", resolve_udp("--listen", "127.0.0.1:0"));
  const UdpEndpoint taken = first.local_endpoint();
  CHECK(taken.port() != 0);
  CHECK_THROWS_WITH(bind_udp(io, "--listen", taken), Catch::Contains("port " + std::to_string(taken.port()) + " is in use"));
}

TEST_CASE("what may be right later is told from what never is") {
  asio::io_context io;
  const UdpSocket first = bind_udp(io, "--listen", resolve_udp("--listen", "127.0.0.1:0"));
  CHECK_THROWS_AS(bind_udp(io, "--listen", first.local_endpoint()), AddressNotReady);
  CHECK_THROWS_AS(bind_udp(io, "--listen", resolve_udp("--listen", "192.0.2.1:4711")), AddressNotReady);
  CHECK_THROWS_AS(resolve_udp("--to", "no-such-host.invalid:1"), AddressNotReady);
  try {
    resolve_udp("--listen", "host:99999");
    FAIL();
  } catch (const InputError& wrong) {
    CHECK(dynamic_cast<const AddressNotReady*>(&wrong) == nullptr);
  }
}

TEST_CASE("the trust channel answers at the interface that a link-local address was heard at") {
  for (const char* text : {"fe80::1", "fe80::2", "2001:db8::1", "::1"}) {
    auto address = asio::ip::make_address_v6(text);
    for (const asio::ip::scope_id_type scope : {0U, 2U, 3U}) {
      if (address.is_link_local()) address.scope_id(scope);
      const UdpEndpoint from(address, 4711);
      CHECK(endpoint_of(channel_address(from), asio::ip::udp::v6()) == from);
    }
  }
  const UdpEndpoint four(asio::ip::make_address("127.0.0.1"), 4711);
  CHECK(endpoint_of(channel_address(four), asio::ip::udp::v4()) == four);
}
