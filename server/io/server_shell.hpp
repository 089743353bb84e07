// Drives a room in real time: a UDP socket and a ServerCore on the thread that calls run(), the body on a second one.
//
// The network thread sleeps until a datagram comes or the core's deadline, takes everything that waits, ticks, sends. A frame job
// goes to the step thread, its result comes back as a task of the network thread; the two share nothing else. The clock is
// steady_clock, read when a datagram is taken from the socket.
#pragma once

#include <array>
#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <exception>
#include <functional>
#include <string>

#include "common/io/endpoint.hpp"
#include "server/core/server_core.hpp"
#include "server/io/peers.hpp"
#include "server/room/room.hpp"

namespace palpate {

class ServerShell {
 public:
  using Say = std::function<void(const std::string&)>;

  /// `listen` is HOST:PORT; InputError when it is not, or the port is in use. `say` gets lines for a person.
  ServerShell(const Scene& scene, const std::string& listen, double rate_hz, Say say);

  UdpEndpoint address() const { return socket_.local_endpoint(); }
  /// Until stop(). Throws what the body threw.
  void run();
  /// Stations are told; run() returns once the frame in hand is done. From a task of context().
  void stop();
  /// For signals and timers beside ours.
  asio::io_context& context() { return io_; }
  const ServerCore& core() const { return core_; }
  /// A line about everything since the start.
  std::string summary() const;

 private:
  static constexpr Micros kReportEvery{5'000'000};

  void receive();
  void step();
  void send_all(Micros now);
  void hand_out(FrameJob job);
  void report();

  Say say_;
  Room room_;
  ServerCore core_;
  asio::io_context io_{1}, step_io_{1};
  UdpSocket socket_;
  asio::steady_timer timer_{io_}, report_timer_{io_};
  Peers peers_;
  std::array<std::byte, 2048> in_{};
  std::array<std::byte, kMaxDatagramBytes> out_{};
  std::uint64_t send_failed_ = 0, strangers_dropped_ = 0;
  bool room_started_ = false;
  ServerCounts reported_;  ///< counts at the last report
  std::exception_ptr failure_;
};

}  // namespace palpate
