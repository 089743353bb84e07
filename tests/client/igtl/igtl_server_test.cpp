// The TCP server with clients of plain sockets, on the loopback of this machine.
#include "client/igtl/app/igtl_server.hpp"

#include <array>
#include <asio/buffer.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

#include "common/base/error.hpp"
#include "tests/client/igtl/ball.hpp"

using namespace palpate;
using asio::ip::tcp;

namespace {

constexpr int kPatience = 20'000;  // turns of a millisecond

tcp::socket connected(asio::io_context& io, const IgtlServer& server) {
  const std::string address = server.address();
  tcp::socket socket(io);
  socket.connect(
      {asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)))});
  return socket;
}

template <class Condition>
void run_until(IgtlServer& server, Condition condition) {
  for (int turn = 0; turn < kPatience && !condition(); ++turn) server.run_for(Micros{1'000});
  REQUIRE(condition());
}

/// Reads whole messages until one has this name. Returns the number read; 0 for damage or the end.
int read_until(tcp::socket& socket, const std::string& name) {
  IgtlReader reader;
  std::array<char, 65'536> bytes;
  asio::error_code fault;
  for (int count = 0;;) {
    const std::size_t size = socket.read_some(asio::buffer(bytes), fault);
    if (fault) return 0;
    reader.add({bytes.data(), size});
    while (const auto message = reader.next()) {
      ++count;
      if (message->name == name) return count;
    }
  }
}

}  // namespace

TEST_CASE("A client that does not read delays nobody, and gets whole messages up to the newest when it reads again", "[igtl]") {
  IgtlServer server("127.0.0.1:0", false);
  asio::io_context io;
  tcp::socket slow = connected(io, server), fast = connected(io, server);
  run_until(server, [&] { return server.clients() == 2; });
  const auto [points, triangles] = test::ball(Vec3f::Zero(), 10, 64);
  const std::vector<float> scalars(points.size());
  constexpr int kBatches = 400;  // 80 MB, more than any buffer holds
  std::atomic<int> fast_count{0};
  std::thread reader([&] { fast_count = read_until(fast, std::to_string(kBatches)); });
  for (int n = 1; n <= kBatches; ++n) {
    server.send(igtl_polydata(std::to_string(n), points, triangles, "s", scalars, 1));
    for (int turn = 0; turn < 3; ++turn) server.run_for(Micros{1'000});
  }
  run_until(server, [&] { return fast_count != 0; });
  reader.join();
  CHECK(fast_count > 1);
  std::atomic<int> slow_count{0};
  std::thread late([&] { slow_count = read_until(slow, std::to_string(kBatches)); });
  run_until(server, [&] { return slow_count != 0; });
  late.join();
  CHECK(slow_count > 0);
  CHECK(slow_count < kBatches);
  slow.close();
  run_until(server, [&] { return server.clients() == 1; });
}

TEST_CASE("A client that sends what is no OpenIGTLink is disconnected where it is listened to, and ignored where it is not",
          "[igtl]") {
  int received = 0;
  IgtlServer listens("127.0.0.1:0", false, [&](const IgtlMessage&) { ++received; }), ignores("127.0.0.1:0", false);
  asio::io_context io;
  tcp::socket good = connected(io, listens), bad = connected(io, listens), other = connected(io, ignores);
  run_until(listens, [&] { return listens.clients() == 2; });
  run_until(ignores, [&] { return ignores.clients() == 1; });
  const std::string nonsense(1000, 'x');
  asio::write(bad, asio::buffer(nonsense));
  asio::write(other, asio::buffer(nonsense));
  asio::write(good, asio::buffer(igtl_transform("tool", Mat3::Identity(), Vec3::Zero(), 1)));
  run_until(listens, [&] { return listens.clients() == 1 && received == 1; });
  for (int turn = 0; turn < 100; ++turn) ignores.run_for(Micros{1'000});
  CHECK(ignores.clients() == 1);
}

TEST_CASE("The server listens beyond this machine only when it is told that this is insecure", "[igtl]") {
  CHECK_THROWS_WITH(IgtlServer("0.0.0.0:0", false), Catch::Contains("neither encrypts nor asks who is there; expected"));
  CHECK_NOTHROW(IgtlServer("0.0.0.0:0", true));
  IgtlServer first("127.0.0.1:0", false);
  CHECK_THROWS_WITH(IgtlServer("127.0.0.1:x", false), Catch::Contains("--listen"));
}
