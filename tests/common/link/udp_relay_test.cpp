#include <catch2/catch.hpp>
#include <set>
#include <string>

#include "common/io/udp_relay.hpp"

using namespace palpate;

namespace {

/// A server that echoes every datagram and records the sender, a relay in front of it, and clients; all on loopback.
class Loopback {
 public:
  explicit Loopback(const LinkSpec& each_way)
      : server_(bind_udp(io_, "server", any())), relay_(io_, bind_udp(io_, "relay", any()), server_.local_endpoint(), each_way) {
    echo();
  }

  UdpSocket client() { return UdpSocket(io_, any()); }
  void send(UdpSocket& client, const std::string& text) { client.send_to(asio::buffer(text), relay_.address()); }
  /// Runs until `client` has received something, or nothing has come for a long time.
  std::string receive(UdpSocket& client, int patience_ms = 5000) {
    std::string text(100, '\0');
    UdpEndpoint from;
    bool got = false;
    client.async_receive_from(asio::buffer(text), from, [&](const asio::error_code& fault, std::size_t size) {
      if (fault) return;
      text.resize(size);
      got = true;
    });
    io_.restart();
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
    while (!got && std::chrono::steady_clock::now() < end) io_.run_one_for(std::chrono::milliseconds(patience_ms));
    if (got) return text;
    client.cancel();
    io_.poll();
    return "nothing";
  }
  const UdpRelay& relay() const { return relay_; }
  std::size_t askers() const { return askers_.size(); }

 private:
  static UdpEndpoint any() { return {asio::ip::address_v4::loopback(), 0}; }
  void echo() {
    server_.async_receive_from(asio::buffer(buffer_), asker_, [this](const asio::error_code& fault, std::size_t size) {
      if (fault == asio::error::operation_aborted) return;
      if (!fault) {
        askers_.insert(asker_);
        server_.send_to(asio::buffer(buffer_, size), asker_);
      }
      echo();
    });
  }

  asio::io_context io_;
  UdpSocket server_;
  std::array<char, 2000> buffer_{};
  UdpEndpoint asker_;
  std::set<UdpEndpoint> askers_;
  UdpRelay relay_;
};

}  // namespace

TEST_CASE("the relay brings every client its own answers and shows the server one port a client") {
  Loopback net({.latency = Micros{500}});
  UdpSocket a = net.client(), b = net.client();
  net.send(a, "from a");
  net.send(b, "from b");
  CHECK(net.receive(b) == "from b");
  CHECK(net.receive(a) == "from a");
  net.send(a, "again");
  CHECK(net.receive(a) == "again");
  CHECK(net.askers() == 2);
  const RelayCounts counts = net.relay().counts();
  CHECK(counts.clients == 2);
  CHECK(counts.up.sent == 3);
  CHECK(counts.down.sent == 3);
  CHECK(counts.send_failed == 0);
}

TEST_CASE("the relay loses and duplicates as its link model does") {
  Loopback deaf({.loss = 1});
  UdpSocket a = deaf.client();
  deaf.send(a, "hello");
  CHECK(deaf.receive(a, 50) == "nothing");
  CHECK(deaf.relay().counts().up.lost == 1);

  Loopback stammering({.duplicate = 1});
  UdpSocket b = stammering.client();
  stammering.send(b, "one");
  for (int i = 0; i < 4; ++i) CHECK(stammering.receive(b) == "one");  // twice up, each echo twice down
  CHECK(stammering.relay().counts().down.duplicated == 2);
}
