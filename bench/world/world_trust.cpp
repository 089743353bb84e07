#include "bench/world/world_trust.hpp"

#include "common/base/random.hpp"
#include "common/wire/messages.hpp"

namespace palpate {
namespace {

constexpr std::int64_t kWorldUnix = 1'800'000'000;
constexpr std::uint16_t kStationPort = 40'000;

}  // namespace

ChannelAddress address_of_peer(std::uint64_t peer) {
  ChannelAddress address;
  address.ip[10] = address.ip[11] = 0xff;
  for (std::size_t k = 0; k < 4; ++k) address.ip[15 - k] = static_cast<std::uint8_t>(peer >> 8 * k);
  address.port = kStationPort;
  return address;
}

std::uint64_t peer_at(const ChannelAddress& address) {
  std::uint64_t peer = 0;
  for (std::size_t k = 0; k < 4; ++k) peer |= std::uint64_t{address.ip[15 - k]} << 8 * k;
  return address == address_of_peer(peer) ? peer : 0;
}

WorldTrust::WorldTrust(const WorldKeys& keys, std::uint64_t seed) : keys_(keys), seed_(seed) {
  site_.self = draw_secret(draw(0));
  site_.stations = keys.more;
  new_server();
}

DrawBytes WorldTrust::draw(std::uint64_t what) const {
  std::uint64_t state = seed_ ^ (what + 1) * 0x9e3779b97f4a7c15ull;
  return [random = std::make_shared<Random>(splitmix64(state))](BytesOut out) {
    for (auto& byte : out) byte = static_cast<std::uint8_t>(random->bits());
  };
}

void WorldTrust::add_station(std::size_t owner, const std::string& name) {
  const std::size_t k = clients_.size();
  clients_.push_back({owner == k ? draw_secret(draw(++drawn_)) : clients_[owner].key, {}});
  if (owner != k) return;
  Rights rights;
  rights.name = name;
  rights.hand = rights.viewer = true;
  site_.stations[public_of(clients_[k].key)] = rights;
  server_->channel().change_keys(site_);
}

void WorldTrust::take_out(std::size_t station) {
  site_.stations.erase(public_of(clients_[station].key));
  server_->channel().change_keys(site_);
}

void WorldTrust::new_server() {
  server_ = std::make_unique<ServerTrust>(
      site_, draw(++drawn_), [] { return kWorldUnix; }, keys_.times);
  if (!keys_.at_once) return;
  for (Client& client : clients_) client.channel.reset();
}

ClientChannel& WorldTrust::client(std::size_t station, Micros own_now) {
  Client& client = clients_[station];
  if (!client.channel)
    client.channel.emplace(ClientKeys{client.key, server_key(), {}}, kWireVersion, draw(++drawn_), own_now, keys_.times);
  return *client.channel;
}

void WorldTrust::shake_hands_at_once(std::size_t station, const ChannelAddress& at, Micros own_now, Micros server_now) {
  std::array<std::byte, kMaxDatagramBytes> plain;
  for (int round = 0; round < 2; ++round) {
    for (const Packet& packet : from_client(station, own_now)) server_->take(packet, at, server_now);
    Packet packet;
    for (ChannelAddress to; next_from_server(packet, to);)
      client(station, own_now).take(octets(std::span<const std::byte>(packet)), own_now, octets(std::span(plain)));
  }
}

WorldTrust::Packet WorldTrust::seal_up(std::size_t station, std::span<const std::byte> plain, Micros own_now) {
  Packet sealed(plain.size() + kDataOverhead);
  sealed.resize(client(station, own_now).seal(octets(plain), octets(std::span(sealed)), own_now));
  return sealed;
}

WorldTrust::Packet WorldTrust::seal_down(ChannelPeer to, std::span<const std::byte> plain, ChannelAddress& address,
                                         Micros server_now) {
  Packet sealed(plain.size() + kDataOverhead);
  sealed.resize(server_->seal(to, plain, sealed, address, server_now));
  return sealed;
}

std::vector<WorldTrust::Packet> WorldTrust::from_client(std::size_t station, Micros own_now) {
  ClientChannel& channel = client(station, own_now);
  channel.tick(own_now);
  std::vector<Packet> all;
  Packet out(kMaxSealedBytes);
  while (const std::size_t size = channel.emit(octets(std::span(out)), own_now))
    all.emplace_back(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size));
  return all;
}

bool WorldTrust::next_from_server(Packet& packet, ChannelAddress& to) {
  packet.resize(kMaxSealedBytes);
  packet.resize(server_->channel().emit(octets(std::span(packet)), to));
  return !packet.empty();
}

WorldTrust::Packet WorldTrust::open(std::size_t station, std::span<const std::byte> datagram, Micros own_now) {
  Packet plain(kMaxDatagramBytes);
  plain.resize(client(station, own_now).take(octets(datagram), own_now, octets(std::span(plain))));
  return plain;
}

}  // namespace palpate
