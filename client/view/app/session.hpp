// ViewCore on a real UDP socket and the real clock. One thread; the caller pumps it.
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/udp.hpp>
#include <string>

#include "client/view/view_core.hpp"

namespace palpate {

/// Monotonic time of this process's clock.
Micros now_us();

class ViewSession {
 public:
  /// `server` is HOST:PORT. Throws InputError when it does not parse or the host does not resolve.
  ViewSession(const std::string& server, const std::string& station, const std::string& room);
  ~ViewSession();

  /// Everything that is due: datagrams in, the core's clock, datagrams out. Never blocks.
  void pump();
  /// Pumps until the given time, sleeping in between; returns at once when the process was told to end.
  void pump_until(Micros time);

  ViewCore& core() { return core_; }
  const std::string& server() const { return server_; }

 private:
  std::string server_;
  asio::io_context io_;
  asio::ip::udp::socket socket_{io_};
  ViewCore core_;
};

/// SIGINT and SIGTERM ask for the end from now on.
void watch_signals();
bool told_to_end();

}  // namespace palpate
