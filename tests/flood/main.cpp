// flood HOST:PORT KIND RATE PORTS SECONDS: so many datagrams a second from so many ports of this machine, in turn. KIND: `noise`
// (not ours), `hello` (a station that joins and never answers), `beat` (of stations that nobody knows). Prints how many were
// sent.
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "common/base/error.hpp"
#include "common/io/endpoint.hpp"
#include "common/wire/codec.hpp"

namespace {

using namespace palpate;
using Clock = std::chrono::steady_clock;

std::vector<std::byte> datagram(const std::string& kind, std::uint32_t number) {
  if (kind == "noise") return std::vector<std::byte>(64, std::byte{0x55});
  std::array<std::byte, kMaxDatagramBytes> bytes;
  Message message;
  message.clock.sent = Micros{number};
  if (kind == "hello")
    message.body = Hello{"flood " + std::to_string(number), Role::haptic, Scheme::port, 0, ""};
  else if (kind == "beat")
    message = {number, number, 1, {Micros{number}, {}, {}}, Beat{}};
  else
    throw InputError("KIND", "is \"" + kind + "\"", "noise, hello or beat");
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(encode(message, bytes))};
}

/// Sockets connected to the server, each at a port of its own.
std::vector<int> open_ports(const UdpEndpoint& server, std::size_t count) {
  const rlimit most{count + 64, count + 64};
  ::setrlimit(RLIMIT_NOFILE, &most);
  std::vector<int> sockets;
  for (std::size_t k = 0; k < count; ++k) {
    const int s = ::socket(server.protocol().family(), SOCK_DGRAM | SOCK_NONBLOCK, 0);
    if (s < 0 || ::connect(s, server.data(), static_cast<socklen_t>(server.size())) != 0)
      throw InputError("PORTS", "port " + std::to_string(k) + " cannot be opened", "fewer");
    sockets.push_back(s);
  }
  return sockets;
}

void flood(int argc, char** argv) {
  if (argc != 6) throw InputError("arguments", std::to_string(argc - 1), "HOST:PORT KIND RATE PORTS SECONDS");
  const std::string kind = argv[2];
  const double rate = std::atof(argv[3]), lasts_s = std::atof(argv[5]);
  const std::vector<int> sockets = open_ports(resolve_udp("HOST:PORT", argv[1]), static_cast<std::size_t>(std::atoi(argv[4])));
  std::vector<std::vector<std::byte>> datagrams;
  for (std::uint32_t k = 0; k < sockets.size(); ++k) datagrams.push_back(datagram(kind, k + 1));
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
