// The page's server and clients of Boost.Beast, on the loopback of this machine.
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <catch2/catch.hpp>
#include <future>

#include "client/web/io/web_server.hpp"
#include "common/base/error.hpp"

using namespace palpate;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = boost::asio::ip::tcp;

namespace {

constexpr char kPassword[] = "a long password & more";

struct Hall : Audience {
  std::vector<BrowserId> came, went;
  std::vector<std::string> words;
  void joined(BrowserId id) override { came.push_back(id); }
  void said(BrowserId, std::string_view text) override { words.emplace_back(text); }
  void left(BrowserId id) override { went.push_back(id); }
};

struct Place {
  Hall hall;
  WebServer web;

  explicit Place(const std::string& password = {})
      : web({"127.0.0.1", 0, password},
            {{"/", "text/html", "the page"}, {"/login", "text/html", "the door", true}, {"/page.css", "text/css", "style", true}},
            hall) {}

  tcp::endpoint endpoint() const {
    const std::string address = web.address();
    return {boost::asio::ip::make_address("127.0.0.1"),
            static_cast<unsigned short>(std::stoi(address.substr(address.rfind(':') + 1)))};
  }
  /// Runs the client beside the server, until it is done.
  template <class Client>
  auto with(Client client) {
    auto done = std::async(std::launch::async, std::move(client));
    while (done.wait_for(std::chrono::seconds(0)) != std::future_status::ready) web.run_for(Micros{2'000});
    return done.get();
  }
  template <class Condition>
  void until(Condition condition) {
    for (int i = 0; i < 10'000 && !condition(); ++i) web.run_for(Micros{2'000});
    REQUIRE(condition());
  }

  struct Ask {
    http::verb verb = http::verb::get;
    std::string target = "/", host = "", origin = "", cookie = "", body = "";
  };
  using Answer = http::response<http::string_body>;
  Answer ask(Ask what) {
    const tcp::endpoint at = endpoint();
    if (what.host.empty()) what.host = web.address();
    return with([at, what] {
      boost::asio::io_context io;
      beast::tcp_stream stream(io);
      stream.connect(at);
      http::request<http::string_body> request(what.verb, what.target, 11);
      request.set(http::field::host, what.host);
      if (!what.origin.empty()) request.set(http::field::origin, what.origin);
      if (!what.cookie.empty()) request.set(http::field::cookie, what.cookie);
      request.body() = what.body;
      request.prepare_payload();
      http::write(stream, request);
      beast::flat_buffer buffer;
      Answer answer;
      http::read(stream, buffer, answer);
      return answer;
    });
  }
};

/// A browser's end of a WebSocket.
struct Tab {
  boost::asio::io_context io;
  websocket::stream<tcp::socket> socket{io};

  beast::error_code open(const tcp::endpoint& at, const std::string& host, const std::string& origin,
                         const std::string& cookie = "") {
    socket.next_layer().connect(at);
    socket.set_option(websocket::stream_base::decorator([=](websocket::request_type& request) {
      if (!origin.empty()) request.set(http::field::origin, origin);
      if (!cookie.empty()) request.set(http::field::cookie, cookie);
    }));
    beast::error_code fault;
    socket.handshake(host, "/live", fault);
    return fault;
  }
  std::string read() {
    beast::flat_buffer buffer;
    socket.read(buffer);
    return beast::buffers_to_string(buffer.data());
  }
};

Packet packet(std::string text) { return {std::make_shared<const std::string>(std::move(text)), false}; }

}  // namespace

TEST_CASE("A page may load and reach nothing but this server, and may not be framed", "[web]") {
  Place place;
  const auto answer = place.ask({});
  CHECK(answer.result() == http::status::ok);
  CHECK(answer.body() == "the page");
  CHECK(answer[http::field::content_type] == "text/html");
  const std::string policy(answer["Content-Security-Policy"]);
  for (const char* rule :
       {"default-src 'none'", "script-src 'self'", "connect-src 'self'", "frame-ancestors 'none'", "base-uri 'none'"})
    CHECK(policy.find(rule) != std::string::npos);
  CHECK(policy.find("unsafe") == std::string::npos);
  CHECK(answer["X-Content-Type-Options"] == "nosniff");
  CHECK(place.ask({.target = "/page.css?x"}).body() == "style");
  CHECK(place.ask({.target = "/../etc/passwd"}).result() == http::status::not_found);
  CHECK(place.ask({.verb = http::verb::delete_}).result() == http::status::method_not_allowed);
  CHECK(place.ask({.verb = http::verb::post, .target = "/login", .body = "password=x"}).result() == http::status::not_found);
}

TEST_CASE("Without a password nobody comes in by another name than this machine's, nor from another site", "[web]") {
  Place place;
  CHECK(place.ask({.host = "rebound.example:80"}).result() == http::status::forbidden);
  CHECK(place.ask({.host = "127.0.0.1.example"}).result() == http::status::forbidden);
  CHECK(place.ask({.host = "localhost:9"}).result() == http::status::ok);
  CHECK(place.ask({.host = "[::1]:9"}).result() == http::status::ok);
  CHECK(place.ask({.origin = "http://elsewhere.example"}).result() == http::status::forbidden);
  const std::string here = place.web.address();
  for (const auto& [host, origin, opens] :
       {std::tuple{here, "http://" + here, true}, std::tuple{here, std::string(), true},
        std::tuple{here, std::string("http://elsewhere.example"), false},
        std::tuple{std::string("rebound.example"), std::string("http://rebound.example"), false}}) {
    const bool opened = place.with([&, at = place.endpoint()] {
      Tab tab;
      return !tab.open(at, host, origin);
    });
    CHECK(opened == opens);
  }
}

TEST_CASE("An address that others can reach needs a password", "[web]") {
  Hall hall;
  CHECK_THROWS_AS(WebServer({"0.0.0.0", 0, ""}, {}, hall), InputError);
  CHECK_NOTHROW(WebServer({"0.0.0.0", 0, kPassword}, {}, hall));
}

TEST_CASE("With a password only the cookie of a sign-in opens page and WebSocket, and guesses are slow", "[web]") {
  Place place(kPassword);
  CHECK(place.ask({}).body() == "the door");
  CHECK(place.ask({.target = "/page.css"}).body() == "style");
  CHECK(place.ask({.target = "/live"}).result() == http::status::unauthorized);
  const auto open = [&](const std::string& cookie) {
    return place.with([&, at = place.endpoint(), here = place.web.address()] {
      Tab tab;
      return !tab.open(at, here, "http://" + here, cookie);
    });
  };
  CHECK_FALSE(open(""));
  const auto wrong = place.ask({.verb = http::verb::post, .target = "/login", .body = "password=a+long+password"});
  CHECK(wrong[http::field::location] == "/#wrong");
  CHECK(wrong.find(http::field::set_cookie) == wrong.end());
  const auto right = place.ask({.verb = http::verb::post, .target = "/login", .body = "password=a+long+password+%26%20more"});
  CHECK(right.result() == http::status::see_other);
  CHECK(right[http::field::location] == "/");
  const std::string set(right[http::field::set_cookie]);
  CHECK(set.find("HttpOnly") != std::string::npos);
  CHECK(set.find("SameSite=Strict") != std::string::npos);
  const std::string cookie = set.substr(0, set.find(';'));
  CHECK(place.ask({.cookie = "other=1; " + cookie}).body() == "the page");
  CHECK(place.ask({.cookie = cookie + "0"}).body() == "the door");
  CHECK(open(cookie));
  CHECK_FALSE(open(cookie.substr(0, cookie.find('=') + 1)));
  bool slowed = false;
  for (int i = 0; i < 6 && !slowed; ++i)
    slowed = place.ask({.verb = http::verb::post, .target = "/login", .body = "password=guess"}).result() ==
             http::status::too_many_requests;
  CHECK(slowed);
}

TEST_CASE("A browser says something and hears something, and long words end its connection", "[web]") {
  Place place;
  Tab tab;
  place.with([&, at = place.endpoint(), here = place.web.address()] { return !tab.open(at, here, ""); });
  place.until([&] { return place.hall.came.size() == 1; });
  place.with([&] { return tab.socket.write(boost::asio::buffer(std::string(R"({"play":true})"))); });
  place.until([&] { return place.hall.words == std::vector<std::string>{R"({"play":true})"}; });
  place.web.send(place.hall.came[0], Slot::room, packet("room"));
  CHECK(place.with([&] { return tab.read(); }) == "room");
  place.with([&] {
    beast::error_code may_end_before_all_is_written;
    return tab.socket.write(boost::asio::buffer(std::string(5000, 'x')), may_end_before_all_is_written);
  });
  place.until([&] { return place.hall.went == place.hall.came; });
  CHECK(place.hall.words.size() == 1);
  place.web.send(place.hall.came[0], Slot::room, packet("nobody"));
  CHECK(place.web.browsers() == 0);
}

TEST_CASE("A browser that does not read costs a few messages, and then gets the newest", "[web]") {
  Place place;
  Tab tab;
  place.with([&, at = place.endpoint(), here = place.web.address()] {
    tab.socket.next_layer().open(tcp::v4());
    tab.socket.next_layer().set_option(boost::asio::socket_base::receive_buffer_size(4096));
    return !tab.open(at, here, "");
  });
  place.until([&] { return place.hall.came.size() == 1; });
  constexpr int kShapes = 2000, kBytes = 20'000;
  for (int i = 0; i < kShapes; ++i) {
    place.web.send(place.hall.came[0], Slot::shape, packet(std::to_string(i) + std::string(kBytes, ' ')));
    place.web.run_for(Micros{100});
  }
  place.web.send(place.hall.came[0], Slot::hello, packet("hello"));
  std::vector<std::string> got;
  bool hello = false;
  while (got.empty() || std::stoi(got.back()) != kShapes - 1) {
    const std::string text = place.with([&] { return tab.read(); });
    if (text == "hello")
      hello = true;
    else
      got.push_back(text.substr(0, text.find(' ')));
  }
  CHECK(hello);
  CHECK(got.size() < 40);  // what the operating system holds: below 1 MB of the 40
}

TEST_CASE("The next browser after the last that is admitted is turned away, until one leaves", "[web]") {
  Place place;
  std::vector<std::unique_ptr<Tab>> tabs;
  const auto open = [&] {
    tabs.push_back(std::make_unique<Tab>());
    return place.with([&, at = place.endpoint(), here = place.web.address()] { return !tabs.back()->open(at, here, ""); });
  };
  for (std::size_t i = 0; i < WebServer::kBrowsersMost; ++i) {
    REQUIRE(open());
    place.until([&] { return place.web.browsers() == i + 1; });
  }
  CHECK_FALSE(open());
  tabs.erase(tabs.begin());
  place.until([&] { return place.web.browsers() == WebServer::kBrowsersMost - 1; });
  CHECK(open());
}
