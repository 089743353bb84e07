// Somebody on the way of every datagram of a simulated world: sees all, and sends what they like in anybody's name.
//
// Everything is drawn from a seed. What is replayed came to its receiver before (links that lose nothing, after kReplayAfter): a
// copy that overtakes its original is not an attack but a faster network.
#pragma once

#include <deque>
#include <memory>

#include "bench/world/run.hpp"
#include "common/base/random.hpp"

namespace palpate::test {

struct AttackCounts {
  std::uint64_t injected = 0, stray_bytes = 0, injected_bytes = 0;
};

class Adversary {
 public:
  static constexpr Micros kEvery{4'000}, kReplayAfter{900'000};

  Adversary(std::uint64_t seed, std::optional<ClientKeys> stolen, AttackCounts& counts)
      : random_(seed), stolen_(std::move(stolen)), counts_(counts) {}

  /// From now on until `end`.
  void attack(World& world, Micros end) {
    world_ = &world;
    world.on_wire = [this](Micros now, const WireEvent& event) {
      seen_.push_back({now, event.client, event.station, event.to_server, {event.bytes.begin(), event.bytes.end()}});
    };
    world.on_stray = [this](const ChannelAddress& to, std::span<const std::byte> bytes) {
      counts_.stray_bytes += bytes.size();
      if (thief_ && to == thief_address()) take(bytes);
    };
    for (Micros at{3'000}; at < end; at += kEvery) world.at(at, [this, at] { act(at); });
  }

 private:
  struct Seen {
    Micros at{};
    ChannelAddress client;
    std::size_t station = 0;
    bool to_server = false;
    std::vector<std::byte> bytes;
  };
  using Packet = std::vector<std::byte>;

  static ChannelAddress thief_address() {
    ChannelAddress address = address_of_peer(0x0a0a0a0a);
    address.port = 666;
    return address;
  }
  ChannelAddress random_address() {
    ChannelAddress address = address_of_peer(0xc0000000 + random_.bits() % 5000);
    address.port = static_cast<std::uint16_t>(1000 + random_.bits() % 5000);
    return address;
  }
  void to_server(const ChannelAddress& from, const Packet& packet) {
    ++counts_.injected;
    counts_.injected_bytes += packet.size();
    world_->inject_to_server(from, packet);
  }
  void to_station(std::size_t station, const Packet& packet) {
    ++counts_.injected;
    world_->inject_to_station(station, packet);
  }
  void send(const Seen& like, const Packet& packet) {
    like.to_server ? to_server(like.client, packet) : to_station(like.station, packet);
  }
  /// One that its receiver has had, or nothing.
  const Seen* old_one() {
    while (seen_.size() > 4000) seen_.pop_front();
    std::size_t old = 0;
    while (old < seen_.size() && seen_[old].at + kReplayAfter < world_->now()) ++old;
    return old > 0 ? &seen_[random_.bits() % old] : nullptr;
  }
  const Seen* any() { return seen_.empty() ? nullptr : &seen_[random_.bits() % seen_.size()]; }

  /// Before, a message of the server's own that is had sooner lets a station in sooner: no attack either.
  bool all_are_in() const {
    for (std::size_t k = 0; k < world_->stations(); ++k)
      if (world_->station(k).core().link() != LinkState::joined) return false;
    return true;
  }

  void act(Micros now) {
    if (!all_are_in()) return;
    if (stolen_) steal(now);
    switch (random_.bits() % 6) {
      case 0:
        if (const Seen* seen = old_one()) send(*seen, seen->bytes);
        break;
      case 1:
        if (const Seen* seen = any()) send(*seen, {seen->bytes.begin(), seen->bytes.begin() + cut(seen->bytes.size())});
        break;
      case 2:
        if (const Seen* seen = any()) send(*seen, flipped(seen->bytes));
        break;
      case 3:
        if (const Seen* seen = any()) reflect(*seen);
        break;
      case 4:
        if (const Seen* seen = any()) forge(*seen);
        break;
      default:
        flood();
    }
  }
  std::ptrdiff_t cut(std::size_t size) { return static_cast<std::ptrdiff_t>(random_.bits() % size); }
  Packet flipped(Packet packet) {
    packet[random_.bits() % packet.size()] ^= static_cast<std::byte>(1 << random_.bits() % 8);
    return packet;
  }
  void reflect(const Seen& seen) { seen.to_server ? to_station(seen.station, seen.bytes) : to_server(seen.client, seen.bytes); }
  /// The head of one that is genuine, with a counter of its own, and bytes that nobody sealed.
  void forge(const Seen& seen) {
    Packet packet = seen.bytes;
    for (std::size_t k = kHeadBytes; k < packet.size(); ++k)
      if (k >= kDataHeadBytes || random_.chance(0.3)) packet[k] = static_cast<std::byte>(random_.bits());
    send(seen, packet);
  }
  /// Many addresses at once; half of it with the server's public key, which is no secret.
  void flood() {
    Packet init(kInitBytes);
    for (int k = 0; k < 30; ++k) {
      for (std::byte& byte : init) byte = static_cast<std::byte>(random_.bits());
      if (random_.chance(0.5)) {
        put_head(octets(std::span(init)), ChannelKind::init, static_cast<std::uint32_t>(random_.bits()));
        const Mac mac = mac1_of(world_->trust().server_key(), octets(std::span<const std::byte>(init)));
        std::copy(mac.begin(), mac.end(), octets(std::span(init)).begin() + kInitSigned);
      }
      to_server(random_address(), init);
    }
  }

  /// With the key of a station for another room: a session of its own, and everything that may be said in it.
  void steal(Micros now) {
    if (!thief_) thief_ = std::make_unique<ClientChannel>(*stolen_, kWireVersion, draw(), now);
    thief_->tick(now);
    Packet out(kMaxSealedBytes);
    while (const std::size_t size = thief_->emit(octets(std::span(out)), now))
      to_server(thief_address(), {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)});
    if (thief_->ready(now)) say(now);
  }
  void take(std::span<const std::byte> bytes) {
    Packet plain(kMaxDatagramBytes);
    thief_->take(octets(bytes), world_->now(), octets(std::span(plain)));
  }
  void say(Micros now) {
    const std::string& victim = world_->station(random_.bits() % world_->stations()).core().welcome().station;
    Message message;
    message.instance = world_->server().options().instance;
    message.station = static_cast<StationId>(1 + random_.bits() % 6);
    message.clock.sent = now;
    switch (random_.bits() % 6) {
      case 0:
        message.body = Leave{};
        break;
      case 1:
        message.body = Samples{.samples = {{now, Vec3(0.1, 0, 0)}}};
        break;
      case 2:
        message.body = Beat{};
        break;
      case 3:
        message.body = Reset{};
        break;
      default:
        message.body = Hello{.station = victim.empty() || random_.chance(0.3) ? "thief" : victim,
                             .shadow_of = random_.chance(0.5) ? victim : ""};
    }
    Packet plain(kMaxDatagramBytes), sealed(kMaxSealedBytes);
    const std::size_t size = encode(message, plain);
    if (size == 0) return;
    sealed.resize(thief_->seal(octets(std::span<const std::byte>(plain).first(size)), octets(std::span(sealed)), now));
    to_server(thief_address(), sealed);
  }
  DrawBytes draw() {
    return [this](BytesOut out) {
      for (auto& byte : out) byte = static_cast<std::uint8_t>(random_.bits());
    };
  }

  Random random_;
  std::optional<ClientKeys> stolen_;
  AttackCounts& counts_;
  World* world_ = nullptr;
  std::deque<Seen> seen_;
  std::unique_ptr<ClientChannel> thief_;
};

}  // namespace palpate::test
