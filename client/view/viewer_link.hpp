// ViewCore on a real UDP socket and the real clock. One thread: the caller pumps it. When the server does not answer, it resolves
// the name again and continues from a new port (client/io/server_finder.hpp).
#pragma once

#include <asio/io_context.hpp>
#include <optional>
#include <span>
#include <string>

#include "client/io/server_finder.hpp"
#include "client/view/view_core.hpp"
#include "common/io/endpoint.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

class ViewerLink {
 public:
  /// `server` is HOST:PORT. Throws InputError when it does not parse or the host does not resolve. The core outlives this object.
  /// `keys`: empty where the server has none. `ask`: resolves the name when nobody answers; the system's resolver by default.
  ViewerLink(const std::string& server, ViewCore& core, const std::optional<ClientKeys>& keys = {}, NameLookup::Ask ask = {});

  /// Handles everything that is due: incoming datagrams, the core's clock, outgoing datagrams. Never blocks.
  void pump();
  /// Blocks until a datagram has arrived, the core has something to do, or `time`; 100 ms at most.
  void wait(Micros time);
  /// Time at which pump() has something to do without a datagram.
  Micros deadline() const;

  const std::string& server() const { return server_; }
  /// True when the server's machine reports that nothing listens at its port, and nothing came since.
  bool nobody_listens() const { return nobody_listens_; }

 private:
  void take(std::span<const std::byte> datagram);
  void connect();
  void send_all();

  std::string server_;
  ViewCore& core_;
  asio::io_context io_;
  UdpSocket socket_{io_};
  UdpEndpoint address_;
  bool nobody_listens_ = false;
  ServerFinder finder_;
  std::optional<ClientChannel> channel_;  ///< only with keys
};

}  // namespace palpate
