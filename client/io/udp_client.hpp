// Drives a ClientCore over a UDP socket in real time, on a thread of its own.
//
// The socket is connected, so that the operating system reports the ICMP message "port unreachable". A connected socket keeps the
// address of the interface that it began with: where no route leads from there, a new socket replaces it after kReopenAfter.
//
// The thread sleeps until a datagram arrives or until the core's deadline, at most kWake while joined, so that samples of the
// haptic thread are sent in time. All waiting datagrams are processed before the core ticks. The clock is steady_clock, the same
// as in the haptic loop. An unexpected error ends the thread, not the program: status() reports it, and the force ends for lack
// of a server. When the server does not answer, the thread resolves the name again and continues from a new port
// (server_finder.hpp). With keys every datagram passes through the trust channel on this thread; the core's messages wait until
// there are keys for it. From start() to stop() the core belongs to the thread (its haptic() to the haptic thread).
#pragma once

#include <array>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "client/core/client_core.hpp"
#include "client/io/server_finder.hpp"
#include "common/io/endpoint.hpp"
#include "common/trust/client_channel.hpp"

namespace palpate {

/// State of the session for other threads.
struct ClientStatus {
  LinkState link = LinkState::joining;
  Welcome welcome;      ///< valid after the first join
  std::string refusal;  ///< ClientCore::refusal()
  RefuseReason refuse_reason = RefuseReason::bad_request;
  bool clock_locked = false;
  RttStats rtt;
  std::uint64_t joins = 0;
  ServerPace pace;
  SchemeInUse in_use;
  GuidanceStatus guidance;
  bool tool_released = false;         ///< ClientCore::tool_released()
  std::uint64_t patches_refused = 0;  ///< ClientCore::patches_refused()
  bool nobody_listens = false;        ///< the server's machine reports that nothing listens at its port, and nothing came since
  std::string fault;                  ///< error that ended the network thread; empty while it runs
};

class UdpClient {
 public:
  /// Called once with each change of the link, in words. On the network thread.
  using Say = std::function<void(const std::string&)>;
  /// Called with each datagram that the core has just received, and its time. On the network thread.
  using Watch = std::function<void(const ClientCore&, std::span<const std::byte>, Micros)>;

  /// `server` is HOST:PORT; InputError when it is not, or does not resolve. The core outlives this object. `keys`: empty where
  /// the server has none. `ask`: resolves the name when nobody answers; the system's resolver by default.
  UdpClient(const std::string& server, ClientCore& core, Say say = {}, Watch watch = {},
            const std::optional<ClientKeys>& keys = {}, NameLookup::Ask ask = {});
  ~UdpClient();
  UdpClient(const UdpClient&) = delete;
  UdpClient& operator=(const UdpClient&) = delete;

  void start();
  /// Says goodbye to the server and ends the thread; afterwards the core may be read. No effect when not started.
  void stop();
  /// Returns the state. Any thread.
  ClientStatus status() const;
  /// Number of datagrams that the operating system refused to send. After stop().
  std::uint64_t send_failed() const { return send_failed_; }

 private:
  static constexpr Micros kWake{1'000}, kReopenAfter{500'000};

  void run();
  void receive();
  void take(std::span<const std::byte> datagram, Micros now);
  void wake();
  void step();
  void connect();
  void move_to(const UdpEndpoint& server, Micros now);
  void send_all(Micros now);
  void send(std::span<const std::byte> datagram);
  void note();
  void tell(LinkState before, const ClientStatus& after);

  ClientCore& core_;
  Say say_;
  Watch watch_;
  std::string server_name_;
  asio::io_context io_{1};
  UdpEndpoint server_;
  UdpSocket socket_;
  int sockets_ = 0;  ///< number of earlier sockets
  ServerFinder finder_;
  asio::steady_timer timer_{io_};
  std::array<std::byte, 2048> in_{};
  std::array<std::byte, kMaxDatagramBytes> out_{}, opened_{};
  std::array<std::byte, kMaxSealedBytes> sealed_{};
  std::optional<ClientChannel> channel_;
  std::uint64_t send_failed_ = 0;
  bool waiting_said_ = false, nobody_listens_ = false;
  bool address_gone_ = false;  ///< true: the interface that the socket is bound to may have another address by now
  Micros opened_at_{};
  mutable std::mutex mutex_;  ///< guards status_; never locked by the haptic thread
  ClientStatus status_;
  std::thread thread_;
};

}  // namespace palpate
