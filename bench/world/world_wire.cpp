// Datagrams through the trust channel in the simulated world, and the attacker's access to them.
#include "bench/world/world.hpp"

namespace palpate {
namespace {

/// The channel's own datagrams arrive on whole milliseconds, when the world is active anyway: an additional look at a core in
/// between could make it act sooner.
Micros whole_ms(Micros t) { return (t + Micros{999}) / Micros{1000} * Micros{1000}; }

}  // namespace

bool World::ready_to_send(std::size_t station, Micros t) {
  if (stations_[station]->peer_ == 0) trust_->new_life(station);
  if (trust_->at_once() && server_up_ && !trust_->client(station, t).ready(t))
    trust_->shake_hands_at_once(station, address_of_peer(peer_of(station)), t, server_clock());
  for (auto& packet : trust_->from_client(station, t)) send_channel(peer_of(station), true, std::move(packet));
  return trust_->client(station, t).ready(t);
}

void World::send_channel(PeerId peer, bool to_server, std::vector<std::byte> sealed) {
  WorldStation& s = station_of(peer);
  see_wire(peer, to_server, sealed);
  if (to_server ? s.cut_up_ : s.cut_down_) return;
  const Datagram datagram{0, peer, to_server, {}, std::move(sealed)};
  for (const Micros at : (to_server ? s.channel_up_ : s.channel_down_).schedule(now_, datagram.sealed.size()))
    in_flight_.push(whole_ms(at), datagram);
}

void World::see_wire(PeerId peer, bool to_server, std::span<const std::byte> bytes) const {
  if (on_wire) on_wire(now_, {peers_[peer - 1], address_of_peer(peer), to_server, bytes});
}

/// Sessions that ended; the room's last messages to them are still to be sealed.
std::vector<ChannelPeer> World::server_channel(Micros t) {
  ServerChannel& channel = trust_->server().channel();
  channel.tick(t);
  std::vector<ChannelPeer> ended = channel.take_ended();
  for (const ChannelPeer peer : ended) server_->expel(peer, t);
  ChannelAddress to;
  for (std::vector<std::byte> packet; trust_->next_from_server(packet, to);) {
    const PeerId peer = peer_at(to);
    if (peer > 0 && peer <= peers_.size())
      send_channel(peer, false, packet);
    else if (on_stray)
      on_stray(to, packet);
  }
  return ended;
}

void World::send_sealed(ChannelPeer to, std::span<const std::byte> bytes, Micros t) {
  ChannelAddress address;
  auto sealed = trust_->seal_down(to, bytes, address, t);
  if (sealed.empty()) return;
  const PeerId peer = peer_at(address);
  if (peer > 0 && peer <= peers_.size())
    send(peer, false, bytes, std::move(sealed));
  else if (on_stray)
    on_stray(address, sealed);
}

/// Returns true for a copy of a datagram that arrived, if those are dropped.
bool World::is_copy(const Datagram& datagram) {
  if (!options_.once) return false;
  if (delivered_.size() <= datagram.number) delivered_.resize(2 * datagram.number + 1, 0);
  return std::exchange(delivered_[datagram.number], std::uint8_t{1}) != 0;
}

void World::take_at_server(const Datagram& datagram) {
  if (trust_)
    open_at_server(address_of_peer(datagram.peer), datagram.sealed, false);
  else if (!is_copy(datagram))
    server_->take(datagram.bytes, datagram.peer, server_clock());
}

/// The channel's answer goes over a link without randomness, so that it does not affect other datagrams.
void World::inject_to_server(const ChannelAddress& from, std::span<const std::byte> bytes) {
  constexpr Micros kWayBack{20'000};
  if (!server_up_ || server_stalled_) return;
  open_at_server(from, bytes, true);
  ChannelAddress to;
  for (std::vector<std::byte> packet; trust_->next_from_server(packet, to);) {
    const PeerId peer = peer_at(to);
    if (peer > 0 && peer <= peers_.size())
      in_flight_.push(whole_ms(now_ + kWayBack), {0, peer, false, {}, packet});
    else if (on_stray)
      on_stray(to, packet);
  }
}

void World::rebind(std::size_t station) {
  peers_.push_back(station);
  stations_[station]->peer_ = peers_.size();
}

void World::tell_brought(const Letter& letter, const ChannelAddress& from) const {
  if (!on_datagram || letter.fault != WireFault::none) return;
  std::size_t station = stations_.size();
  if (const auto end = ends_.find(letter.from); end != ends_.end()) {
    if (stations_[end->second.station]->lives() == end->second.life) station = end->second.station;
  } else if (const PeerId peer = peer_at(from); peer > 0 && peer <= peers_.size()) {
    if (stations_[peers_[peer - 1]]->peer_ == peer) station = peers_[peer - 1];
  }
  if (station == stations_.size()) return;
  std::array<std::byte, kMaxDatagramBytes> plain;
  const auto size = encode(letter.message, plain);
  on_datagram(now_, {DatagramEvent::Kind::brought, 0, station, true, std::span(plain).first(size)});
}

void World::open_at_server(const ChannelAddress& from, std::span<const std::byte> bytes, bool brought) {
  const auto letter = trust_->server().take(bytes, from, server_clock());
  if (!letter) return;
  if (brought)
    tell_brought(*letter, from);
  else if (const PeerId peer = peer_at(from); stations_[peers_[peer - 1]]->peer_ == peer)
    ends_[letter->from] = {peers_[peer - 1], stations_[peers_[peer - 1]]->lives()};
  if (letter->ruling.anew) server_->expel(letter->from, server_clock());
  if (letter->ruling.refused)
    server_->refuse(letter->message, letter->from, *letter->ruling.refused, letter->size, server_clock());
  else
    server_->take(letter->fault, letter->message, letter->size, letter->from, server_clock());
}

void World::take_at_station(std::size_t station, const Datagram& datagram) {
  WorldStation& s = *stations_[station];
  if (trust_) {
    const auto plain = trust_->open(station, datagram.sealed, s.clock(now_));
    if (!plain.empty()) s.core_->take(plain, s.clock(now_));
  } else if (!is_copy(datagram)) {
    s.core_->take(datagram.bytes, s.clock(now_));
  }
}

void World::inject_to_station(std::size_t station, std::span<const std::byte> bytes) {
  WorldStation& s = *stations_[station];
  if (!s.net_runs()) return;
  const auto plain = trust_->open(station, bytes, s.clock(now_));
  if (plain.empty()) return;
  if (on_datagram) on_datagram(now_, {DatagramEvent::Kind::brought, 0, station, false, plain});
  s.core_->take(plain, s.clock(now_));
}

}  // namespace palpate
