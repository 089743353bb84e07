// A viewer's session on real sockets of this machine.
#include <catch2/catch.hpp>

#include "client/view/app/session.hpp"

using namespace palpate;

namespace {

struct Home {
  asio::io_context io;
  UdpSocket socket{io, UdpEndpoint(asio::ip::address_v4::loopback(), 0)};
  UdpEndpoint from;

  Home() { socket.non_blocking(true); }
  UdpEndpoint address() const { return socket.local_endpoint(); }
  /// Returns true if a Hello came; stores its sender.
  bool asked() {
    std::array<std::byte, kMaxDatagramBytes> datagram;
    asio::error_code none;
    const auto size = socket.receive_from(asio::buffer(datagram), from, 0, none);
    Message message;
    return !none && decode(std::span(datagram).first(size), message) == WireFault::none &&
           std::holds_alternative<Hello>(message.body);
  }
  bool asked_within(ViewSession& session, Micros time) {
    for (const Micros end = now_us() + time; now_us() < end;) {
      session.pump_until(now_us() + Micros{10'000});
      if (asked()) return true;
    }
    return false;
  }
};

}  // namespace

TEST_CASE("A viewer whom nobody answers goes on at the address that the server's name has by now, from another port", "[view]") {
  constexpr Micros kPatience{60'000'000};
  Home before, after;
  std::string name_asked;
  ViewSession session(to_string(before.address()), "watcher", "", false, {}, [&](const std::string& name) {
    name_asked = name;
    return after.address();
  });
  REQUIRE(before.asked_within(session, kPatience));
  const UdpEndpoint first = before.from;
  REQUIRE(after.asked_within(session, kPatience));
  CHECK(name_asked == to_string(before.address()));
  CHECK(after.from.port() != first.port());
  const UdpEndpoint second = after.from;
  while (after.from == second) REQUIRE(after.asked_within(session, kPatience));  // nobody answers there either
  CHECK(after.from.port() != second.port());
}
