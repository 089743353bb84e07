// HTTP and WebSocket for browsers (Boost.Beast). One thread: the caller runs it.
//
//     GET /            the page and its files; without the cookie of a sign-in, where a password is set, the form for it
//     POST /login      the password; the answer sets the cookie
//     GET /live        WebSocket: messages of client/web/web_frames.hpp
//
// What a browser can use: one message on its way and one waiting in each slot, which a newer one replaces; a request of 8 kB of
// header and 1 kB of text; a message of 1 kB; 30 s without an answer. There are kBrowsersMost browsers and kConnectionsMost
// connections at most. Without a password only requests to a name of this machine's loopback are answered, so that a page from
// elsewhere cannot reach them by a name of its own (DNS rebinding); a WebSocket that another site opens is refused.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

using BrowserId = std::uint64_t;

/// Messages to a browser, most urgent first. Each slot holds the newest of its kind.
enum class Slot : std::uint8_t { hello, mesh, parts, history, room, notes, summary, shape };
inline constexpr std::size_t kSlots = 8;

/// A message, shared by all browsers that get it.
struct Packet {
  std::shared_ptr<const std::string> bytes;
  bool binary = false;
};

/// Listener for what browsers do.
class Audience {
 public:
  virtual ~Audience() = default;
  virtual void joined(BrowserId id) = 0;
  /// `text` comes from the network.
  virtual void said(BrowserId id, std::string_view text) = 0;
  virtual void left(BrowserId id) = 0;
};

struct WebFile {
  std::string_view path, type, text;
  bool open = false;  ///< true: served without a sign-in
};

struct WebOptions {
  std::string address;     ///< numeric
  std::uint16_t port = 0;  ///< 0: a free one
  std::string password;    ///< empty: none
};

class WebServer {
 public:
  static constexpr std::size_t kBrowsersMost = 32, kConnectionsMost = 128;

  /// Listens. `files` has "/" and "/login", and outlives this object as does `audience`. Throws InputError when the address
  /// cannot be listened at, or others could reach it and there is no password.
  WebServer(const WebOptions& options, std::vector<WebFile> files, Audience& audience);
  ~WebServer();

  /// Returns for example "127.0.0.1:8080"; with the name of the machine, where every address of it is listened at.
  std::string address() const;
  /// Handles what browsers do, for this long.
  void run_for(Micros time);
  /// Sends this, or keeps it until the browser has taken what is on its way. No effect for a browser that left.
  void send(BrowserId id, Slot slot, Packet packet);
  std::size_t browsers() const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace palpate
