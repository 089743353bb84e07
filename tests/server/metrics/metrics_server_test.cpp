// The pages over HTTP, read while the server runs.
#include "server/metrics/io/metrics_server.hpp"

#include <algorithm>
#include <asio/ip/tcp.hpp>
#include <asio/read.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <catch2/catch.hpp>
#include <set>
#include <thread>
#include <vector>

#include "common/base/error.hpp"
#include "common/io/endpoint.hpp"
#include "common/io/monotonic.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

std::string get(const std::string& address, const std::string& path, const std::string& method = "GET") {
  const HostPort there = parse_host_port("test", address);
  asio::io_context io;
  asio::ip::tcp::socket socket(io);
  socket.connect({asio::ip::make_address(there.host), there.port});
  asio::write(socket, asio::buffer(method + " " + path + " HTTP/1.1\r\nHost: test\r\nConnection: close\r\n\r\n"));
  std::string answer;
  asio::error_code end;
  asio::read(socket, asio::dynamic_buffer(answer), end);
  return answer;
}

/// State in which all rooms have `n` joined stations, so that an answer mixed from two states would show.
ServerState state_with(std::uint64_t n) {
  ServerState state;
  state.at = monotonic_now();
  for (const char* name : {"a", "b", "c"}) {
    state.rooms.emplace_back();
    state.rooms.back().name = name;
    state.rooms.back().counts.joins = n;
  }
  return state;
}

}  // namespace

TEST_CASE("before the first state the server loads: well, not ready, and without figures of rooms") {
  MetricsServer server("--metrics", "127.0.0.1:0", "0.1.0");
  CHECK(get(server.address(), "/healthz").starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(get(server.address(), "/readyz").starts_with("HTTP/1.1 503 Service Unavailable\r\n"));
  CHECK(get(server.address(), "/readyz").ends_with("\r\n\r\nloading\n"));
  CHECK(get(server.address(), "/metrics").find("palpate_") == std::string::npos);
  server.publish(state_with(1));
  CHECK(get(server.address(), "/readyz").ends_with("\r\n\r\nok\n"));
  CHECK(get(server.address(), "/metrics").find("palpate_joins_total{room=\"b\"} 1\n") != std::string::npos);
  CHECK_THAT(get(server.address(), "/metrics/more"), Catch::StartsWith("HTTP/1.1 404"));
  const std::string whole = get(server.address(), "/readyz");
  CHECK(get(server.address(), "/readyz", "HEAD") == whole.substr(0, whole.find("\r\n\r\n") + 4));
}

TEST_CASE("connections that say nothing keep no health check waiting") {
  MetricsServer server("--metrics", "127.0.0.1:0", "test");
  const HostPort there = parse_host_port("test", server.address());
  asio::io_context io;
  std::vector<asio::ip::tcp::socket> silent;
  for (int k = 0; k < 24; ++k) {
    silent.emplace_back(io).connect({asio::ip::make_address(there.host), there.port});
    silent.back().non_blocking(true);
  }
  CHECK(get(server.address(), "/healthz").starts_with("HTTP/1.1 200 OK\r\n"));
  // Before the first of them was closed.
  CHECK(std::all_of(silent.begin(), silent.end(), [](asio::ip::tcp::socket& socket) {
    char one = 0;
    asio::error_code fault;
    socket.read_some(asio::buffer(&one, 1), fault);
    return fault == asio::error::would_block;
  }));
}

TEST_CASE("an address that is taken, or none, is bad input") {
  MetricsServer server("--metrics", "127.0.0.1:0", "0.1.0");
  CHECK_THROWS_AS(MetricsServer("--metrics", server.address(), "0.1.0"), InputError);
  CHECK_THROWS_AS(MetricsServer("--metrics", "127.0.0.1", "0.1.0"), InputError);
}

TEST_CASE("whoever reads gets one whole state, the newest or a later one, while the next are published") {
  MetricsServer server("--metrics", "127.0.0.1:0", "0.1.0");
  server.publish(state_with(0));
  std::atomic<bool> over = false;
  std::thread writer([&] {
    for (std::uint64_t n = 1; !over; ++n) server.publish(state_with(n));
  });
  std::vector<std::thread> readers;
  std::atomic<int> mixed = 0, missing = 0, backwards = 0;
  for (int r = 0; r < 3; ++r)
    readers.emplace_back([&] {
      std::uint64_t before = 0;
      for (int k = 0; k < 100; ++k) {
        const std::string answer = get(server.address(), k % 4 == 0 ? "/healthz" : "/metrics");
        if (k % 4 == 0) continue;
        std::set<std::uint64_t> seen;
        for (const char* room : {"a", "b", "c"}) {
          const std::string series = std::string("palpate_joins_total{room=\"") + room + "\"} ";
          const std::size_t at = answer.find(series);
          at == std::string::npos ? void(++missing) : void(seen.insert(std::stoull(answer.substr(at + series.size()))));
        }
        mixed += seen.size() != 1;
        backwards += !seen.empty() && *seen.begin() < before;
        if (!seen.empty()) before = *seen.begin();
      }
    });
  for (std::thread& reader : readers) reader.join();
  over = true;
  writer.join();
  CHECK(missing == 0);
  CHECK(mixed == 0);
  CHECK(backwards == 0);
}

TEST_CASE("a request with a body is refused and its connection closed, before the body has come") {
  MetricsServer server("--metrics", "127.0.0.1:0", "test");
  const HostPort there = parse_host_port("test", server.address());
  for (const std::string head : {"Content-Length: 100000000", "Transfer-Encoding: chunked"})
    for (const std::string method : {"GET", "HEAD"}) {
      asio::io_context io;
      asio::ip::tcp::socket socket(io);
      socket.connect({asio::ip::make_address(there.host), there.port});
      asio::write(socket, asio::buffer(method + " /healthz HTTP/1.1\r\nHost: test\r\n" + head + "\r\n\r\n"));
      std::string answer;
      asio::error_code end;
      asio::read(socket, asio::dynamic_buffer(answer), end);  // to the end of the connection
      CAPTURE(head, method);
      CHECK(answer.starts_with("HTTP/1.1 400 Bad Request\r\n"));
      CHECK(end);
    }
  CHECK(get(server.address(), "/healthz").starts_with("HTTP/1.1 200 OK\r\n"));
}
