// Boost.Asio and the standalone Asio of the rest share names at global scope: no file includes both.
#include "client/web/io/web_server.hpp"

#include <netinet/tcp.h>
#include <sodium.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/rate_limit.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = boost::asio::ip::tcp;
using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr std::size_t kHeaderBytesMost = 8192, kTextBytesMost = 1024;
constexpr int kUnsentBytesMost = 16384;  // in the operating system, per browser: half a second of shapes
constexpr std::chrono::seconds kPatience{30};
constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'";

std::string_view view(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// Returns the host of a Host header, without the port.
std::string_view host_of(std::string_view authority) {
  if (authority.starts_with('[')) return authority.substr(0, authority.find(']') + 1);
  return authority.substr(0, authority.find(':'));
}

bool is_loopback_name(std::string_view host) {
  if (host == "localhost" || host == "[::1]") return true;
  boost::system::error_code none;
  const auto address = boost::asio::ip::make_address_v4(std::string(host), none);
  return !none && address.is_loopback();
}

/// Compares without telling by the time how much was right.
bool same_secret(std::string_view a, std::string_view b) {
  std::array<std::array<unsigned char, crypto_generichash_BYTES>, 2> hashes;
  crypto_generichash(hashes[0].data(), hashes[0].size(), reinterpret_cast<const unsigned char*>(a.data()), a.size(), nullptr, 0);
  crypto_generichash(hashes[1].data(), hashes[1].size(), reinterpret_cast<const unsigned char*>(b.data()), b.size(), nullptr, 0);
  return sodium_memcmp(hashes[0].data(), hashes[1].data(), hashes[0].size()) == 0;
}

std::string draw_hex() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot be used");
  std::array<unsigned char, 32> bytes;
  randombytes_buf(bytes.data(), bytes.size());
  std::string hex(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), bytes.data(), bytes.size());
  hex.pop_back();
  return hex;
}

/// Returns the value of `name` in "name=value&..." with %XX and +; empty when it is missing.
std::string form_value(std::string_view form, std::string_view name) {
  while (!form.empty()) {
    const std::string_view field = form.substr(0, form.find('&'));
    form.remove_prefix(std::min(form.size(), field.size() + 1));
    if (field.size() <= name.size() || !field.starts_with(name) || field[name.size()] != '=') continue;
    std::string value;
    for (std::size_t i = name.size() + 1; i < field.size(); ++i) {
      if (field[i] == '%' && i + 2 < field.size() && std::isxdigit(static_cast<unsigned char>(field[i + 1])) &&
          std::isxdigit(static_cast<unsigned char>(field[i + 2]))) {
        value += static_cast<char>(std::stoi(std::string(field.substr(i + 1, 2)), nullptr, 16));
        i += 2;
      } else {
        value += field[i] == '+' ? ' ' : field[i];
      }
    }
    return value;
  }
  return {};
}

}  // namespace

struct WebServer::Inside {
  class Browser;
  class Connection;

  Inside(const WebOptions& options, std::vector<WebFile> served, Audience& whom)
      : files(std::move(served)), audience(whom), password(options.password), cookie_value(draw_hex()) {
    const tcp::endpoint at(boost::asio::ip::make_address(options.address), options.port);
    if (!at.address().is_loopback() && password.empty())
      throw InputError("--listen", "others can reach this address, and there is no password",
                       "an address of the loopback, or --password FILE");
    boost::system::error_code fault;
    acceptor.open(at.protocol(), fault);
    if (!fault) acceptor.set_option(tcp::acceptor::reuse_address(true), fault);
    if (!fault) acceptor.bind(at, fault);
    if (!fault) acceptor.listen(boost::asio::socket_base::max_listen_connections, fault);
    if (fault) throw InputError("--listen", fault.message(), "an address and a free port of this machine");
    cookie_name = "palpate" + std::to_string(acceptor.local_endpoint().port());
    accept();
  }

  void accept();
  bool signed_in(const Request& request) const;
  bool from_here(const Request& request) const;
  Response answer(const Request& request);
  Response log_in(const Request& request);
  Response plain(const Request& request, http::status status, std::string text) const;
  const WebFile* find(std::string_view path) const;

  std::size_t connections = 0;  ///< counts what `io` holds, so it outlives that
  boost::asio::io_context io{1};
  tcp::acceptor acceptor{io};
  std::vector<WebFile> files;
  Audience& audience;
  std::string password, cookie_name, cookie_value;
  RateLimit attempts{5, Micros{1'000'000}};
  BrowserId next_id = 1;
  std::map<BrowserId, std::weak_ptr<Browser>> there;
};

/// A browser's WebSocket.
class WebServer::Inside::Browser : public std::enable_shared_from_this<Browser> {
 public:
  Browser(Inside& inside, beast::tcp_stream&& stream) : inside_(inside), socket_(std::move(stream)), id_(inside.next_id++) {
    ++inside_.connections;
  }
  ~Browser() { --inside_.connections; }

  void begin(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = kPatience;
    timeout.idle_timeout = kPatience;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.read_message_max(kTextBytesMost);
    socket_.auto_fragment(false);
    auto& plain = beast::get_lowest_layer(socket_).socket();
    boost::system::error_code ignored;
    plain.set_option(tcp::no_delay(true), ignored);
    ::setsockopt(plain.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytesMost, sizeof kUnsentBytesMost);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code fault) {
      if (!fault) self->accepted();
    });
  }

  void send(Slot slot, Packet packet) {
    waiting_[static_cast<std::size_t>(slot)] = std::move(packet);
    write();
  }

 private:
  void accepted() {
    inside_.there[id_] = weak_from_this();
    inside_.audience.joined(id_);
    read();
  }

  void read() {
    socket_.async_read(in_, [self = shared_from_this()](beast::error_code fault, std::size_t) {
      if (fault) return self->leave();
      if (self->socket_.got_text())
        self->inside_.audience.said(self->id_, {static_cast<const char*>(self->in_.data().data()), self->in_.size()});
      self->in_.clear();
      self->read();
    });
  }

  void write() {
    if (writing_.bytes) return;
    for (Packet& packet : waiting_) {
      if (!packet.bytes) continue;
      writing_ = std::exchange(packet, {});
      socket_.binary(writing_.binary);
      socket_.async_write(boost::asio::buffer(*writing_.bytes),
                          [self = shared_from_this()](beast::error_code fault, std::size_t) {
                            self->writing_ = {};
                            if (fault) return self->leave();
                            self->write();
                          });
      return;
    }
  }

  void leave() {
    if (inside_.there.erase(id_) > 0) inside_.audience.left(id_);
  }

  Inside& inside_;
  websocket::stream<beast::tcp_stream> socket_;
  BrowserId id_;
  beast::flat_buffer in_;
  std::array<Packet, kSlots> waiting_;
  Packet writing_;
};

/// A connection until it becomes a browser's WebSocket.
class WebServer::Inside::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Inside& inside, tcp::socket&& socket) : inside_(inside), stream_(std::move(socket)) { ++inside_.connections; }
  ~Connection() { --inside_.connections; }

  void read() {
    parser_.emplace();
    parser_->header_limit(kHeaderBytesMost);
    parser_->body_limit(kTextBytesMost);
    stream_.expires_after(kPatience);
    http::async_read(stream_, in_, *parser_, [self = shared_from_this()](beast::error_code fault, std::size_t) {
      if (!fault) self->take(self->parser_->release());
    });
  }

 private:
  void take(Request request) {
    if (websocket::is_upgrade(request) && request.target() == "/live" && inside_.from_here(request) &&
        inside_.signed_in(request) && inside_.there.size() < kBrowsersMost) {
      std::make_shared<Browser>(inside_, std::move(stream_))->begin(request);
      return;
    }
    response_ = inside_.answer(request);
    response_.keep_alive(request.keep_alive());
    response_.prepare_payload();
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code fault, std::size_t) {
      if (!fault && self->response_.keep_alive()) return self->read();
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, fault);
    });
  }

  Inside& inside_;
  beast::tcp_stream stream_;
  beast::flat_buffer in_{kHeaderBytesMost + kTextBytesMost};
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
};

void WebServer::Inside::accept() {
  acceptor.async_accept([this](boost::system::error_code fault, tcp::socket socket) {
    if (fault == boost::asio::error::operation_aborted) return;
    if (!fault && connections < kConnectionsMost) std::make_shared<Connection>(*this, std::move(socket))->read();
    accept();
  });
}

bool WebServer::Inside::signed_in(const Request& request) const {
  if (password.empty()) return true;
  const std::string wanted = cookie_name + "=";
  for (std::string_view cookies = view(request[http::field::cookie]); !cookies.empty();) {
    std::string_view cookie = cookies.substr(0, cookies.find(';'));
    cookies.remove_prefix(std::min(cookies.size(), cookie.size() + 1));
    while (cookie.starts_with(' ')) cookie.remove_prefix(1);
    if (cookie.starts_with(wanted) && same_secret(cookie.substr(wanted.size()), cookie_value)) return true;
  }
  return false;
}

/// True for a request that no page of another site made a browser send.
bool WebServer::Inside::from_here(const Request& request) const {
  const std::string_view host = view(request[http::field::host]), origin = view(request[http::field::origin]);
  if (password.empty() && !is_loopback_name(host_of(host))) return false;
  return origin.empty() || origin == "http://" + std::string(host) || origin == "https://" + std::string(host);
}

const WebFile* WebServer::Inside::find(std::string_view path) const {
  for (const WebFile& file : files)
    if (file.path == path) return &file;
  return nullptr;
}

Response WebServer::Inside::plain(const Request& request, http::status status, std::string text) const {
  Response response(status, request.version());
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.set("Content-Security-Policy", kPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "same-origin");  // without a referrer a browser sends "Origin: null" with a form
  response.set(http::field::cache_control, "no-store");
  response.body() = std::move(text);
  return response;
}

Response WebServer::Inside::log_in(const Request& request) {
  if (password.empty()) return plain(request, http::status::not_found, "there is no password\n");
  if (!attempts.allows(monotonic_now()))
    return plain(request, http::status::too_many_requests, "too many attempts; wait a second\n");
  attempts.take(monotonic_now());
  const bool right = same_secret(form_value(request.body(), "password"), password);
  Response response = plain(request, http::status::see_other, "");
  response.set(http::field::location, right ? "/" : "/#wrong");
  if (right) response.set(http::field::set_cookie, cookie_name + "=" + cookie_value + "; Path=/; HttpOnly; SameSite=Strict");
  return response;
}

Response WebServer::Inside::answer(const Request& request) {
  if (!from_here(request)) return plain(request, http::status::forbidden, "this page is for this machine alone\n");
  const std::string_view target = view(request.target()), path = target.substr(0, target.find('?'));
  if (request.method() == http::verb::post && path == "/login") return log_in(request);
  if (request.method() != http::verb::get) return plain(request, http::status::method_not_allowed, "GET is expected\n");
  if (path == "/live")
    return plain(request, signed_in(request) ? http::status::service_unavailable : http::status::unauthorized,
                 signed_in(request) ? "a WebSocket is expected, or there are too many browsers\n" : "sign in first\n");
  const WebFile* file = find(path);
  if (file == nullptr) return plain(request, http::status::not_found, "there is no such page\n");
  if (!file->open && !signed_in(request)) file = find("/login");
  Response response = plain(request, http::status::ok, std::string(file->text));
  response.set(http::field::content_type, boost::beast::string_view(file->type.data(), file->type.size()));
  return response;
}

WebServer::WebServer(const WebOptions& options, std::vector<WebFile> files, Audience& audience)
    : inside_(std::make_unique<Inside>(options, std::move(files), audience)) {}
WebServer::~WebServer() = default;

std::string WebServer::address() const {
  const tcp::endpoint at = inside_->acceptor.local_endpoint();
  if (at.address().is_unspecified()) return boost::asio::ip::host_name() + ":" + std::to_string(at.port());
  const std::string host = at.address().to_string();
  return (at.address().is_v6() ? "[" + host + "]" : host) + ":" + std::to_string(at.port());
}

void WebServer::run_for(Micros time) { inside_->io.run_for(time); }

void WebServer::send(BrowserId id, Slot slot, Packet packet) {
  if (const auto at = inside_->there.find(id); at != inside_->there.end())
    if (const auto browser = at->second.lock()) browser->send(slot, std::move(packet));
}

std::size_t WebServer::browsers() const { return inside_->there.size(); }

}  // namespace palpate
