// The io shells on real sockets. Nothing here depends on how long things take, only on that they happen.
#include <asio/post.hpp>
#include <catch2/catch.hpp>
#include <thread>

#include "client/io/udp_client.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"
#include "server/io/server_shell.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// A server on a free port, on its own thread.
struct RunningServer {
  ServerShell shell{{{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, {"127.0.0.1:0", 20, 1}, {}};
  std::string address = to_string(shell.address());
  std::thread thread{[this] { shell.run(); }};
  ~RunningServer() {
    asio::post(shell.context(), [this] { shell.stop(); });
    thread.join();
  }
};

template <class Condition>
bool eventually(Condition condition) {
  for (const auto end = monotonic_now() + 20s; monotonic_now() < end; std::this_thread::sleep_for(1ms))
    if (condition()) return true;
  return false;
}

ClientOptions named(const std::string& name) {
  ClientOptions options;
  options.hello.station = name;
  return options;
}

}  // namespace

TEST_CASE("a client joins a real server over a real socket, gets patches, and says goodbye") {
  RunningServer server;
  std::vector<std::string> said;
  ClientCore core(named("hand"), monotonic_now());
  UdpClient client(server.address, core, [&](const std::string& line) { said.push_back(line); });
  client.start();
  REQUIRE(eventually([&] { return client.status().link == LinkState::joined; }));
  const Vec3 home = client.status().welcome.home;
  TickOutput out;
  REQUIRE(eventually([&] {
    out = core.haptic().tick({monotonic_now(), home});
    return out.has_patch;
  }));
  CHECK(client.status().clock_locked);
  client.stop();
  CHECK(core.counts().patches > 0);
  REQUIRE(said.size() == 2);
  CHECK(said[0] == "waiting for server at " + server.address);
  CHECK(said[1] == "joined scene \"cube6\" at 20 Hz");
}

TEST_CASE("a second hand on the node is refused by name of the reason") {
  RunningServer server;
  ClientCore first(named("first"), monotonic_now()), second(named("second"), monotonic_now());
  UdpClient a(server.address, first), b(server.address, second);
  a.start();
  REQUIRE(eventually([&] { return a.status().link == LinkState::joined; }));
  b.start();
  REQUIRE(eventually([&] { return b.status().link == LinkState::refused; }));
  CHECK(b.status().refuse_reason == RefuseReason::node_taken);
  CHECK(b.status().refusal.find("first") != std::string::npos);
  a.stop();
  CHECK(eventually([&] { return b.status().link == LinkState::joined; }));
}

TEST_CASE("a port in use and a host that does not parse are bad input") {
  RunningServer server;
  const auto scene = load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json");
  CHECK_THROWS_AS(ServerShell({{"cube", scene}}, {server.address, 20, 1}, {}), InputError);
  ClientCore core(named("hand"), monotonic_now());
  CHECK_THROWS_AS(UdpClient("127.0.0.1", core), InputError);
  CHECK_THROWS_AS(UdpClient("127.0.0.1:0", core), InputError);
}
