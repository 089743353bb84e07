// UdpServer on a thread of its own, for a program that does something else beside. Stations and viewers join it over UDP as they
// join palpate-server; nothing is recorded. Threads: one object, one thread at a time.
#pragma once

#include <atomic>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "server/io/udp_server.hpp"

namespace palpate {

struct ThreadedServerOptions {
  std::string listen = "127.0.0.1:0";  ///< HOST:PORT; port 0: a free one
  std::string key_file;                ///< keys of the site (palpate-key); empty: none, for the loopback alone
  double rate_hz = 20;                 ///< frames a second
};

class ThreadedServer {
 public:
  /// Listens at once. Throws InputError for rooms without distinct names, an address that is not free, and one that others can
  /// reach where there are no keys.
  ThreadedServer(const std::vector<NamedScene>& rooms, const ThreadedServerOptions& options);
  /// Says goodbye to the stations.
  ~ThreadedServer();
  ThreadedServer(const ThreadedServer&) = delete;
  ThreadedServer& operator=(const ThreadedServer&) = delete;

  /// For example "127.0.0.1:47800".
  const std::string& address() const { return address_; }
  /// Throws the exception of the last remaining body, after which nobody is served.
  void check() const;

 private:
  UdpServer server_;
  std::string address_;
  std::exception_ptr fault_;
  std::atomic<bool> failed_{false};  ///< true: `fault_` is set
  std::thread thread_;
};

}  // namespace palpate
