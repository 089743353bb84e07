// TCP for OpenIGTLink clients such as 3D Slicer. One thread: the caller runs it.
//
// A client has one batch of messages on its way and one waiting, which a newer one replaces: a slow one misses moments, never
// parts of one, and delays nobody. There are kClientsMost at most.
#pragma once

#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "client/igtl/igtl_messages.hpp"

namespace palpate {

class IgtlServer {
 public:
  static constexpr std::size_t kClientsMost = 16;
  using Received = std::function<void(const IgtlMessage&)>;

  /// Listens at HOST:PORT of --listen. `received`: called for each message of a client; without it what clients send is not
  /// looked at. Throws InputError when the address cannot be listened at, or is beyond this machine and not `insecure`.
  IgtlServer(const std::string& listen, bool insecure, Received received = {});
  ~IgtlServer();

  /// Returns for example "127.0.0.1:18944".
  std::string address() const;
  std::size_t clients() const { return clients_.size(); }
  /// Handles what clients do. Returns after `time`, or sooner when something happened.
  void run_for(Micros time);
  /// Sends a batch to every client that keeps up.
  void send(std::string batch);

 private:
  class Client;
  void accept();

  asio::io_context io_;
  asio::ip::tcp::acceptor acceptor_{io_};
  Received received_;
  std::set<std::shared_ptr<Client>> clients_;
};

}  // namespace palpate
