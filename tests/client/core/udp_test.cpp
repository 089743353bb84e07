// The I/O shells on real sockets. Nothing here depends on durations, only on events.
#include <asio/post.hpp>
#include <atomic>
#include <catch2/catch.hpp>
#include <future>
#include <set>
#include <thread>

#include "client/io/udp_client.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"
#include "server/io/udp_server.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// A server on a free port, on its own thread.
struct RunningServer {
  UdpServer shell{{{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, {"127.0.0.1:0", 20, 1}, {}};
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

TEST_CASE("a body that throws ends its own room: its hand is told and refused, the hand beside goes on") {
  const auto scene = [](const char* name) { return load_scene(std::string(PALPATE_SOURCE_DIR "/scenes/") + name + ".json"); };
  ShellOptions options{"127.0.0.1:0", 60, 2};
  options.simulate = [](Room& room, const FrameJob& job) {
    for (const StationJob& station : job.stations)
      if (!station.samples.empty() && station.samples.back().position.x() > 1) throw std::runtime_error("out of the world");
    return room.simulate(job);
  };
  std::atomic<int> said = 0;
  UdpServer shell({{"one", scene("cube6")}, {"other", scene("touch-cube")}}, options, [&](const ServerEvent& event) {
    said += event.kind == "room_failed" && event.text == "room \"one\": the body failed and the room is closed: out of the world";
  });
  std::thread thread([&] { shell.run(); });
  std::vector<std::unique_ptr<ClientCore>> cores;
  std::vector<std::unique_ptr<UdpClient>> clients;
  for (const char* room : {"one", "other"}) {
    ClientOptions hand = named("hand");
    hand.hello.room = room;
    cores.push_back(std::make_unique<ClientCore>(hand, monotonic_now()));
    clients.push_back(std::make_unique<UdpClient>(to_string(shell.address()), *cores.back()));
    clients.back()->start();
  }
  const auto tick = [&](std::size_t k, double x) { return cores[k]->haptic().tick({monotonic_now(), Vec3(x, 0, 0.1)}); };
  REQUIRE(eventually([&] {
    tick(0, 2);
    return clients[0]->status().link == LinkState::refused;
  }));
  CHECK(clients[0]->status().refusal == "the body of this room failed");
  CHECK(said == 1);
  REQUIRE(eventually([&] { return clients[1]->status().link == LinkState::joined; }));
  const Vec3 home = clients[1]->status().welcome.home - Vec3(0, 0, 0.022);
  CHECK(eventually([&] { return cores[1]->haptic().tick({monotonic_now(), home}).has_patch; }));
  for (auto& client : clients) client->stop();
  asio::post(shell.context(), [&] { shell.stop(); });
  thread.join();
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

TEST_CASE(
    "two rooms of one process serve a hand each on a pool of threads, and a room that is not there is refused with the list") {
  const auto scene = [](const char* name) { return load_scene(std::string(PALPATE_SOURCE_DIR "/scenes/") + name + ".json"); };
  UdpServer shell({{"grasped", scene("cube6")}, {"touched", scene("touch-cube")}}, {"127.0.0.1:0", 60, 2}, {});
  std::thread thread([&] { shell.run(); });
  const std::string address = to_string(shell.address());
  std::vector<std::unique_ptr<ClientCore>> cores;
  std::vector<std::unique_ptr<UdpClient>> clients;
  for (const char* room : {"grasped", "touched", "nowhere"}) {
    ClientOptions options = named("hand");  // the same name in each: rooms share nothing
    options.hello.room = room;
    cores.push_back(std::make_unique<ClientCore>(options, monotonic_now()));
    clients.push_back(std::make_unique<UdpClient>(address, *cores.back()));
    clients.back()->start();
  }
  for (std::size_t k = 0; k < 2; ++k) {
    REQUIRE(eventually([&] { return clients[k]->status().link == LinkState::joined; }));
    const Vec3 tool = clients[k]->status().welcome.home - Vec3(0, 0, k == 0 ? 0.0 : 0.022);
    REQUIRE(eventually([&] { return cores[k]->haptic().tick({monotonic_now(), tool}).has_patch; }));
  }
  CHECK(clients[0]->status().welcome.contact == ContactKind::attach);
  CHECK(clients[1]->status().welcome.contact == ContactKind::touch);
  REQUIRE(eventually([&] { return clients[2]->status().link == LinkState::refused; }));
  CHECK(clients[2]->status().refusal == "no room \"nowhere\" here; there is grasped, touched");
  for (auto& client : clients) client->stop();
  asio::post(shell.context(), [&] { shell.stop(); });
  thread.join();
  REQUIRE(shell.summary().size() == 2);
  CHECK(shell.summary()[1].starts_with("room \"touched\": in all 1 join,"));
}

TEST_CASE("a frame that does not end is seen by whoever watches, while the network goes on") {
  std::promise<void> go_on;
  ShellOptions options{"127.0.0.1:0", 20, 1};
  options.simulate = [wait = go_on.get_future().share()](Room& room, const FrameJob& job) {
    wait.wait();
    return room.simulate(job);
  };
  UdpServer shell({{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, options, {});
  std::atomic<Micros> longest{Micros{}};
  std::atomic<int> hands = 0, joins = 0;
  shell.on_pulse([&](const ServerState& state) {
    longest = state.rooms.at(0).computing_for;
    hands = state.rooms.at(0).hands;
    joins = static_cast<int>(state.rooms.at(0).counts.joins);
  });
  std::thread thread([&] { shell.run(); });
  ClientCore core(named("hand"), monotonic_now());
  UdpClient client(to_string(shell.address()), core);
  client.start();
  CHECK(eventually([&] { return hands == 1 && longest.load() > 1s; }));
  CHECK(joins == 1);
  go_on.set_value();
  CHECK(eventually([&] { return longest.load() == 0s; }));
  client.stop();
  CHECK(eventually([&] { return hands == 0; }));
  asio::post(shell.context(), [&] { shell.stop(); });
  thread.join();
}

TEST_CASE("a client whose server moved asks for the name again, and feels the body at the new address") {
  auto first = std::make_unique<RunningServer>();
  RunningServer second;
  ClientCore core(named("hand"), monotonic_now());
  std::atomic<int> asked = 0;
  UdpClient client(first->address, core, {}, {}, {}, [&](const std::string& name) {
    ++asked;
    CHECK(name != second.address);
    return resolve_udp("name", second.address);
  });
  client.start();
  REQUIRE(eventually([&] { return client.status().link == LinkState::joined; }));
  const Vec3 home = client.status().welcome.home;
  first.reset();
  double force = 0;
  bool stepped = false;
  REQUIRE(eventually([&] {
    const TickOutput out = core.haptic().tick({monotonic_now(), home});
    stepped = stepped || out.force.norm() > force + 2;
    force = out.force.norm();
    return client.status().joins == 2 && out.has_patch;
  }));
  CHECK_FALSE(stepped);
  CHECK(asked >= 1);
  client.stop();
}

TEST_CASE("a client that nobody answers looks for its server from a new port, every three seconds") {
  asio::io_context io;
  UdpSocket silent = bind_udp(io, "silent", resolve_udp("silent", "127.0.0.1:0"));
  silent.non_blocking(true);
  ClientCore core(named("hand"), monotonic_now());
  UdpClient client(to_string(silent.local_endpoint()), core);
  client.start();
  std::set<std::uint16_t> ports;
  CHECK(eventually([&] {
    std::array<std::byte, 2048> bytes;
    UdpEndpoint from;
    asio::error_code none;
    if (silent.receive_from(asio::buffer(bytes), from, 0, none) > 0 && !none) ports.insert(from.port());
    return ports.size() == 3;
  }));
  client.stop();
}

TEST_CASE("a client says that nothing listens at a closed port, and no more once a server is there") {
  asio::io_context io;
  std::string address;
  {
    const UdpSocket closed_soon = bind_udp(io, "closed", resolve_udp("closed", "127.0.0.1:0"));
    address = to_string(closed_soon.local_endpoint());
  }
  ClientCore core(named("hand"), monotonic_now());
  UdpClient client(address, core);
  client.start();
  CHECK(eventually([&] { return client.status().nobody_listens; }));
  bool known = true;  // also from the next port
  for (const auto end = monotonic_now() + ServerFinder::kMoveAfter; monotonic_now() < end; std::this_thread::sleep_for(1ms))
    known = known && client.status().nobody_listens;
  CHECK(known);
  CHECK(no_answer_text(address, client.status().nobody_listens, false) == "nothing listens at " + address);
  UdpServer shell({{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, {address, 20, 1}, {});
  std::thread thread([&] { shell.run(); });
  CHECK(eventually([&] { return client.status().link == LinkState::joined; }));
  CHECK_FALSE(client.status().nobody_listens);
  client.stop();
  asio::post(shell.context(), [&] { shell.stop(); });
  thread.join();
}

TEST_CASE("a server with keys tells a client without one that it needs one, in no more bytes than the client sent") {
  ShellOptions options{"127.0.0.1:0", 20, 1};
  options.keys.emplace();
  options.keys->self = draw_secret(system_random());
  UdpServer shell({{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, options, {});
  std::thread thread([&] { shell.run(); });
  ClientCore core(named("hand"), monotonic_now());
  UdpClient client(to_string(shell.address()), core);
  client.start();
  CHECK(eventually([&] { return client.status().link == LinkState::refused; }));
  CHECK(client.status().refuse_reason == RefuseReason::bad_request);
  CHECK(client.status().refusal.find("a key is needed") == 0);
  client.stop();
  asio::post(shell.context(), [&] { shell.stop(); });
  thread.join();
  CHECK(core.counts().bytes_received <= core.counts().bytes_sent);
}

TEST_CASE("a port in use and a host that does not parse are bad input") {
  RunningServer server;
  const auto scene = load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json");
  CHECK_THROWS_AS(UdpServer({{"cube", scene}}, {server.address, 20, 1}, {}), InputError);
  ClientCore core(named("hand"), monotonic_now());
  CHECK_THROWS_AS(UdpClient("127.0.0.1", core), InputError);
  CHECK_THROWS_AS(UdpClient("127.0.0.1:0", core), InputError);
}
