#include "common/io/udp_relay.hpp"

#include <algorithm>
#include <asio/buffer.hpp>

#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;

void add(LinkCounts& sum, const LinkCounts& more) {
  sum.sent += more.sent;
  sum.lost += more.lost;
  sum.queue_dropped += more.queue_dropped;
  sum.duplicated += more.duplicated;
  sum.reordered += more.reordered;
  sum.bytes += more.bytes;
}

LinkSpec with_seed(LinkSpec spec, std::uint64_t seed) {
  spec.seed = seed;
  return spec;
}

}  // namespace

struct UdpRelay::Client {
  Client(asio::io_context& io, const UdpEndpoint& address_, const UdpEndpoint& server, const LinkSpec& spec, std::uint64_t& seeds)
      : address(address_),
        socket(open_udp_towards(io, server)),
        up(with_seed(spec, splitmix64(seeds))),
        down(with_seed(spec, splitmix64(seeds))),
        buffer(kLargestDatagram) {
    socket.non_blocking(true);
  }

  UdpEndpoint address, sender;
  UdpSocket socket;  ///< towards the server
  LinkModel up, down;
  Micros last_heard{};
  std::vector<std::byte> buffer;
};

UdpRelay::UdpRelay(asio::io_context& io, UdpSocket listen, const UdpEndpoint& server, const LinkSpec& each_way)
    : io_(io),
      listen_(std::move(listen)),
      server_(server),
      each_way_(each_way),
      seed_state_(each_way.seed),
      timer_(io),
      buffer_(kLargestDatagram) {
  validate(each_way_, "link");
  listen_.non_blocking(true);
  receive_from_clients();
}

UdpRelay::~UdpRelay() = default;

UdpEndpoint UdpRelay::address() const { return listen_.local_endpoint(); }

RelayCounts UdpRelay::counts() const {
  RelayCounts sum = counts_;
  for (const auto& [address, client] : clients_) {
    add(sum.up, client->up.counts());
    add(sum.down, client->down.counts());
  }
  return sum;
}

void UdpRelay::receive_from_clients() {
  listen_.async_receive_from(asio::buffer(buffer_), sender_, [this](const asio::error_code& fault, std::size_t size) {
    if (fault == asio::error::operation_aborted) return;
    if (!fault) {
      const auto client = client_at(sender_);
      client->last_heard = monotonic_now();
      enter(client, true, size, buffer_.data());
    }
    receive_from_clients();
  });
}

void UdpRelay::receive_from_server(const std::shared_ptr<Client>& client) {
  client->socket.async_receive_from(asio::buffer(client->buffer), client->sender,
                                    [this, client](const asio::error_code& fault, std::size_t size) {
                                      if (fault == asio::error::operation_aborted || !client->socket.is_open()) return;
                                      if (!fault && client->sender == server_) enter(client, false, size, client->buffer.data());
                                      receive_from_server(client);
                                    });
}

std::shared_ptr<UdpRelay::Client> UdpRelay::client_at(const UdpEndpoint& address) {
  if (const auto found = clients_.find(address); found != clients_.end()) return found->second;
  if (clients_.size() >= kMaxClients) forget_oldest();
  auto client = std::make_shared<Client>(io_, address, server_, each_way_, seed_state_);
  clients_.emplace(address, client);
  ++counts_.clients;
  receive_from_server(client);
  return client;
}

void UdpRelay::forget_oldest() {
  const auto oldest = std::min_element(clients_.begin(), clients_.end(),
                                       [](const auto& a, const auto& b) { return a.second->last_heard < b.second->last_heard; });
  add(counts_.up, oldest->second->up.counts());
  add(counts_.down, oldest->second->down.counts());
  asio::error_code ignored;
  oldest->second->socket.close(ignored);
  clients_.erase(oldest);
}

void UdpRelay::enter(const std::shared_ptr<Client>& client, bool up, std::size_t size, const std::byte* bytes) {
  for (const Micros due : (up ? client->up : client->down).schedule(monotonic_now(), size))
    under_way_.push(due, {client, up, std::vector<std::byte>(bytes, bytes + size)});
  send_due();
}

void UdpRelay::send_due() {
  const Micros moment = monotonic_now();
  while (const auto datagram = under_way_.pop(moment)) {
    const auto& client = *datagram->client;
    if (!client.socket.is_open()) continue;
    asio::error_code fault;
    if (datagram->up)
      datagram->client->socket.send_to(asio::buffer(datagram->bytes), server_, 0, fault);
    else
      listen_.send_to(asio::buffer(datagram->bytes), client.address, 0, fault);
    counts_.send_failed += fault ? 1 : 0;
  }
  wait_for_next();
}

void UdpRelay::wait_for_next() {
  if (under_way_.empty()) return;
  timer_.expires_at(monotonic_at(under_way_.next_due()));
  timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) send_due();
  });
}

}  // namespace palpate
