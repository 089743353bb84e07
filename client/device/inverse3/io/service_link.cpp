#include "client/device/inverse3/io/service_link.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>

#include "common/base/error.hpp"

namespace palpate {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using std::chrono::steady_clock;

constexpr Micros kEndMost{50'000}, kLook{50'000};
constexpr const char* kExpected = "Haply's Inverse Service, which runs with the Haply Hub or as haply-inverse-service";

}  // namespace

struct ServiceLink::Inside {
  Inside(std::uint16_t given, const std::atomic<bool>& stop) : port(given), give_up(stop) {}

  /// Runs what `start` begins until its handler is called. Returns its result, or a timeout; nothing may run afterwards then.
  template <class Start>
  beast::error_code finish(Micros most, Start start) {
    std::optional<beast::error_code> result;
    start([&result](beast::error_code error) { result = error; });
    const auto until = steady_clock::now() + most;
    while (!result && steady_clock::now() < until && !give_up) run_one(until);
    return result ? *result : beast::error_code(beast::error::timeout);
  }

  void run_one(steady_clock::time_point until) {
    io.restart();
    io.run_one_until(std::min(until, steady_clock::now() + kLook));
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError("127.0.0.1:" + std::to_string(port), what, kExpected);
  }

  void connect() {
    const std::array places{tcp::endpoint(asio::ip::address_v4::loopback(), port),
                            tcp::endpoint(asio::ip::address_v6::loopback(), port)};
    auto& stream = beast::get_lowest_layer(socket).socket();
    const auto connected = finish(kPatience, [&](auto done) {
      asio::async_connect(stream, places, [done](beast::error_code error, const tcp::endpoint&) { done(error); });
    });
    if (connected == asio::error::connection_refused || connected == asio::error::address_family_not_supported ||
        connected == asio::error::network_unreachable ||
        connected == asio::error::make_error_code(asio::error::basic_errors(EADDRNOTAVAIL)))
      fail("nothing listens");
    if (connected) fail("no connection: " + connected.message());
    stream.set_option(tcp::no_delay(true));
    socket.read_message_max(kMessageBytesMost);
    socket.auto_fragment(false);
    const auto greeted = finish(kPatience, [&](auto done) {
      socket.async_handshake("localhost:" + std::to_string(port), "/", [done](beast::error_code error) { done(error); });
    });
    if (greeted == beast::error::timeout) fail("it accepts a connection and does not answer");
    if (greeted) fail("it accepts no WebSocket: " + greeted.message());
  }

  void read() {
    socket.async_read(in, [this](beast::error_code error, std::size_t) {
      if (error) return broken(error);
      if (!runs) return;
      receive({static_cast<const char*>(in.data().data()), in.size()});
      in.clear();
      read();
    });
  }

  void wait(std::chrono::nanoseconds period) {
    due = std::max(due + period, steady_clock::now());
    timer.expires_at(due);
    timer.async_wait([this, period](beast::error_code error) {
      if (error || !runs) return;
      runs = turn();
      if (runs) wait(period);
    });
  }

  void broken(beast::error_code error) {
    if (!fault.empty()) return;
    if (error == websocket::error::closed || error == asio::error::eof || error == asio::error::connection_reset)
      fault = "its service closed the connection";
    else if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow)
      fault = "its service sends messages of more than 256 kB";
    else
      fault = "the connection to its service broke";
  }

  std::uint16_t port;
  const std::atomic<bool>& give_up;
  asio::io_context io{1};  // before what it runs
  websocket::stream<beast::tcp_stream> socket{io};
  asio::steady_timer timer{io};
  steady_clock::time_point due{};
  beast::flat_buffer in;
  std::string out, fault;
  std::function<void(std::string_view)> receive;
  std::function<bool()> turn;
  bool writing = false, runs = false;
};

ServiceLink::ServiceLink(std::uint16_t port, const std::atomic<bool>& give_up)
    : inside_(std::make_unique<Inside>(port, give_up)) {
  inside_->connect();
}
ServiceLink::~ServiceLink() = default;

std::string ServiceLink::first_message() {
  auto& in = inside_->in;
  const auto error = inside_->finish(
      kPatience, [&](auto done) { inside_->socket.async_read(in, [done](beast::error_code read, std::size_t) { done(read); }); });
  if (error == beast::error::timeout) inside_->fail("it sends no list of its devices");
  if (error) {
    inside_->broken(error);
    inside_->fail(inside_->fault);
  }
  std::string message(static_cast<const char*>(in.data().data()), in.size());
  in.clear();
  return message;
}

void ServiceLink::run(std::chrono::nanoseconds period, std::function<void(std::string_view)> receive,
                      std::function<bool()> turn) {
  Inside& own = *inside_;
  own.receive = std::move(receive);
  own.turn = std::move(turn);
  own.due = steady_clock::now();
  own.runs = true;
  own.io.restart();
  own.read();
  own.wait(period);
  while (own.runs && own.fault.empty()) own.io.run_one();
  own.runs = false;
}

bool ServiceLink::writing() const { return inside_->writing; }

void ServiceLink::send(std::string message) {
  inside_->out = std::move(message);
  inside_->writing = true;
  inside_->socket.async_write(asio::buffer(inside_->out), [this](beast::error_code error, std::size_t) {
    inside_->writing = false;
    if (error) inside_->broken(error);
  });
}

void ServiceLink::end(std::string message) {
  const auto until = steady_clock::now() + kEndMost;
  while (writing() && fault().empty() && steady_clock::now() < until) inside_->run_one(until);
  if (writing() || !fault().empty()) return;
  send(std::move(message));
  while (writing() && steady_clock::now() < until) inside_->run_one(until);
  bool closed = false;
  if (!writing() && fault().empty())
    inside_->socket.async_close(websocket::close_code::normal, [&closed](beast::error_code) { closed = true; });
  while (!closed && fault().empty() && steady_clock::now() < until) inside_->run_one(until);
}

const std::string& ServiceLink::fault() const { return inside_->fault; }

}  // namespace palpate
