// Drives a ViewCore over a UDP socket in real time. One thread: the caller pumps it.
//
// The socket is connected, so that the operating system reports the ICMP message "port unreachable". When the server does not
// answer, the viewer resolves the name again and continues from a new port (server_finder.hpp). With keys every datagram passes
// through the trust channel. The clock is steady_clock (common/io/monotonic.hpp).
#pragma once

#include <asio/io_context.hpp>
#include <optional>
#include <span>
#include <string>

#include "client/io/server_finder.hpp"
#include "client/viewer/view_core.hpp"
#include "common/io/endpoint.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

class UdpViewer {
 public:
  /// `server` is HOST:PORT. Throws InputError when it does not parse or the host does not resolve. `alike`: the server may assign
  /// a similar name when `station` is in use. `ask`: resolves the name when nobody answers; the system's resolver by default.
  UdpViewer(const std::string& server, const std::string& station, const std::string& room, bool alike,
            const std::optional<ClientKeys>& keys = {}, NameLookup::Ask ask = {});
  /// Says goodbye to the server.
  ~UdpViewer();
  UdpViewer(const UdpViewer&) = delete;
  UdpViewer& operator=(const UdpViewer&) = delete;

  /// Handles everything that is due: incoming datagrams, the core's clock, outgoing datagrams. Never blocks.
  void pump();
  /// Sleeps until a datagram arrives or something is due, at most until `time` and for kNapMost.
  void nap(Micros time);

  /// Time at which pump() has something to do without a datagram.
  Micros deadline() const;

  ViewCore& core() { return core_; }
  const ViewCore& core() const { return core_; }
  const std::string& server() const { return server_; }
  /// True while the server has not answered for kNoAnswerAfter.
  bool unanswered() const;
  /// Says why it may not have answered.
  std::string no_answer() const { return no_answer_text(server_, nobody_listens_, channel_.has_value()); }

 private:
  static constexpr Micros kNapMost{100'000};

  void take(std::span<const std::byte> datagram);
  void connect();
  void send_all();

  std::string server_;
  asio::io_context io_;
  UdpSocket socket_{io_};
  ViewCore core_;
  UdpEndpoint address_;
  bool nobody_listens_ = false;  ///< true: the server's machine reports that nothing listens at its port, and nothing came since
  ServerFinder finder_;
  std::optional<ClientChannel> channel_;  ///< only with keys
};

}  // namespace palpate
