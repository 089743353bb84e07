// flood HOST:PORT KIND RATE PORTS SECONDS [SERVER]: sends RATE datagrams a second from PORTS ports of this machine, in turn.
// KIND:
//
//     noise       no datagrams of ours
//     hello       a station that joins and never answers
//     beat        from unknown stations
//     init        handshakes made with the server's public key SERVER, without cookies
//     handshake   the same with cookies, from stations that the server does not know
//
// The last two use addresses of their own (127.1.0.1 and on), with 250 ports each; `neighbour` is `handshake` from the default
// address. Prints the number of datagrams sent.
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/error.hpp"
#include "common/io/endpoint.hpp"
#include "common/trust/client_channel.hpp"
#include "common/wire/codec.hpp"

namespace {

using namespace palpate;
using Clock = std::chrono::steady_clock;
using Packet = std::vector<std::byte>;

Packet datagram(const std::string& kind, std::uint32_t number) {
  if (kind == "noise") return Packet(64, std::byte{0x55});
  std::array<std::byte, kMaxDatagramBytes> bytes;
  Message message;
  message.clock.sent = Micros{number};
  if (kind == "hello")
    message.body = Hello{"flood " + std::to_string(number), Role::haptic, Scheme::port, 0, ""};
  else if (kind == "beat")
    message = {number, number, 1, {Micros{number}, {}, {}}, Beat{}};
  else
    throw InputError("KIND", "is \"" + kind + "\"", "noise, hello, beat, init, handshake or neighbour");
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(encode(message, bytes))};
}

/// Returns an Init to the server, on request with the cookie for this socket; without one if the server does not answer in time.
Packet init(const PublicKey& server, int socket, bool with_cookie) {
  constexpr int kPatienceMs = 20, kTries = 50;
  ClientChannel channel({draw_secret(system_random()), server, {}}, kWireVersion, system_random(), Micros{});
  Packet packet(kInitBytes), answer(kMaxSealedBytes), plain(kMaxDatagramBytes);
  Micros now{};
  channel.tick(now);
  channel.emit(octets(std::span(packet)), now);
  for (int k = 0; with_cookie && k < kTries; ++k) {
    ::send(socket, packet.data(), packet.size(), 0);
    pollfd waits{socket, POLLIN, 0};
    if (::poll(&waits, 1, kPatienceMs) <= 0) continue;
    const auto size = ::recv(socket, answer.data(), answer.size(), 0);
    if (size != static_cast<ssize_t>(kCookieBytes)) continue;
    channel.take(octets(std::span<const std::byte>(answer).first(kCookieBytes)), now, octets(std::span(plain)));
    channel.emit(octets(std::span(packet)), now += kInitEvery);
    return packet;
  }
  return packet;
}

/// Sockets connected to the server, each at its own port; `spread`: 250 per address.
std::vector<int> open_ports(const UdpEndpoint& server, std::size_t count, bool spread) {
  constexpr std::size_t kAtAddress = 250;
  const rlimit most{count + 64, count + 64};
  ::setrlimit(RLIMIT_NOFILE, &most);
  std::vector<int> sockets;
  for (std::size_t k = 0; k < count; ++k) {
    const int s = ::socket(server.protocol().family(), SOCK_DGRAM | SOCK_NONBLOCK, 0);
    const UdpEndpoint own(asio::ip::address_v4(static_cast<std::uint32_t>(0x7f010001 + k / kAtAddress)), 0);
    const bool bound = s >= 0 && (!spread || ::bind(s, own.data(), static_cast<socklen_t>(own.size())) == 0);
    if (!bound || ::connect(s, server.data(), static_cast<socklen_t>(server.size())) != 0)
      throw InputError("PORTS", "port " + std::to_string(k) + " cannot be opened", "fewer");
    sockets.push_back(s);
  }
  return sockets;
}

void flood(int argc, char** argv) {
  if (argc != 6 && argc != 7)
    throw InputError("arguments", std::to_string(argc - 1), "HOST:PORT KIND RATE PORTS SECONDS [SERVER]");
  const std::string kind = argv[2];
  const double rate = std::atof(argv[3]), lasts_s = std::atof(argv[5]);
  const bool keyed = argc == 7, spread = kind == "init" || kind == "handshake";
  const std::vector<int> sockets =
      open_ports(resolve_udp("HOST:PORT", argv[1]), static_cast<std::size_t>(std::atoi(argv[4])), spread);
  const auto server = keyed ? key_from(argv[6]) : std::optional<PublicKey>();
  if (keyed && !server) throw InputError("SERVER", argv[6], "a public key");
  std::vector<Packet> datagrams;
  for (std::uint32_t k = 0; k < sockets.size(); ++k)
    datagrams.push_back(keyed ? init(*server, sockets[k], kind != "init") : datagram(kind, k + 1));
  std::printf("begins\n");
  std::fflush(stdout);
  std::uint64_t due = 0, sent = 0, failed = 0;
  const auto begin = Clock::now();
  for (double t = 0; t < lasts_s; t = std::chrono::duration<double>(Clock::now() - begin).count()) {
    for (; due < static_cast<std::uint64_t>(t * rate); ++due) {
      const std::size_t k = due % sockets.size();
      const bool ok = ::send(sockets[k], datagrams[k].data(), datagrams[k].size(), 0) > 0;
      ++(ok ? sent : failed);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  std::printf("%llu sent, %llu not, %.0f a second\n", static_cast<unsigned long long>(sent),
              static_cast<unsigned long long>(failed), static_cast<double>(sent) / lasts_s);
  for (const int s : sockets) ::close(s);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    flood(argc, argv);
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "flood: %s\n", fault.what());
    return 2;
  }
}
