// Passes datagrams between clients and one server over simulated bad links: clients talk to the relay as if it were the server,
// and the server sees every client at a port of its own. Bytes are not inspected.
//
// Every client has its own two LinkModels (one per direction) with seeds drawn from the spec's; the first client's links are the
// same in every run with the same seed. At most kMaxClients; a further one replaces the one that has been silent longest.
#pragma once

#include <asio/steady_timer.hpp>
#include <map>
#include <memory>
#include <vector>

#include "common/io/endpoint.hpp"
#include "common/link/delay_queue.hpp"
#include "common/link/link_model.hpp"

namespace palpate {

struct RelayCounts {
  LinkCounts up, down;  ///< client to server, server to client; all clients
  std::uint64_t clients = 0, send_failed = 0;
};

class UdpRelay {
 public:
  static constexpr std::size_t kMaxClients = 256;

  /// Takes ownership of a bound socket. Runs while `io` does; `each_way` holds for both directions.
  UdpRelay(asio::io_context& io, UdpSocket listen, const UdpEndpoint& server, const LinkSpec& each_way);
  UdpRelay(const UdpRelay&) = delete;
  UdpRelay& operator=(const UdpRelay&) = delete;
  ~UdpRelay();

  UdpEndpoint address() const;
  RelayCounts counts() const;

 private:
  struct Client;
  struct Datagram {
    std::shared_ptr<Client> client;
    bool up = false;
    std::vector<std::byte> bytes;
  };

  void receive_from_clients();
  void receive_from_server(const std::shared_ptr<Client>& client);
  std::shared_ptr<Client> client_at(const UdpEndpoint& address);
  void forget_oldest();
  void enter(const std::shared_ptr<Client>& client, bool up, std::size_t size, const std::byte* bytes);
  void send_due();
  void wait_for_next();

  asio::io_context& io_;
  UdpSocket listen_;
  UdpEndpoint server_, sender_;
  LinkSpec each_way_;
  std::uint64_t seed_state_;
  std::map<UdpEndpoint, std::shared_ptr<Client>> clients_;
  DelayQueue<Datagram> under_way_;
  asio::steady_timer timer_;
  std::vector<std::byte> buffer_;
  RelayCounts counts_;  ///< counts of discarded clients
};

}  // namespace palpate
