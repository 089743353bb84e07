// Serves /metrics, /healthz and /readyz over HTTP, for Prometheus and for monitoring in general.
//
// prometheus-cpp formats the text; its own web server, civetweb, is used directly, as the library's Exposer serves only metrics.
// Both run on civetweb's threads. The network thread hands over its state through a LatestSlot and never waits for readers;
// readers wait for each other.
#pragma once

#include <asio/ip/tcp.hpp>
#include <memory>
#include <string>

#include "server/io/server_state.hpp"

namespace palpate {

class MetricsServer {
 public:
  /// Starts serving. `address` is HOST:PORT, with port 0 for any; throws InputError with `flag` if it is invalid or in use.
  MetricsServer(const std::string& flag, const std::string& address, std::string version);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  /// Publishes a state; call from one thread only. Before the first the server counts as loading.
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
