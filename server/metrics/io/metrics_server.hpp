// /metrics, /healthz and /readyz over HTTP, for Prometheus and for whoever keeps servers running.
//
// prometheus-cpp makes the text; civetweb, the server that prometheus-cpp itself stands on, is used without that library's
// Exposer, which serves nothing but metrics. Both work on civetweb's own threads. The network thread hands over its state through
// a LatestSlot and never waits for anybody who reads; readers wait for each other.
#pragma once

#include <asio/ip/tcp.hpp>
#include <memory>
#include <string>

#include "server/io/server_state.hpp"

namespace palpate {

class MetricsServer {
 public:
  /// Serves from now on. `address`: HOST:PORT, port 0 for any; InputError with `flag` when it is none or is in use.
  MetricsServer(const std::string& flag, const std::string& address, std::string version);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  /// From one thread. Until the first the server counts as loading.
  void publish(ServerState state);
  /// HOST:PORT at which it serves.
  const std::string& address() const { return address_; }

 private:
  struct Served;
  std::unique_ptr<Served> served_;
  asio::ip::tcp::endpoint there_;
  std::string address_;
};

}  // namespace palpate
