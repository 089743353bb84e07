#include "bench/world/adversary.hpp"

#include <algorithm>

namespace palpate {
namespace {

constexpr std::size_t kRemembered = 4000;  ///< datagrams
constexpr int kFlood = 30;

ChannelAddress thief_address() {
  ChannelAddress address = address_of_peer(0x0a0a0a0a);
  address.port = 666;
  return address;
}

ChannelAddress victim_address() {
  ChannelAddress address = address_of_peer(0x0b0b0b0b);
  address.port = 53;
  return address;
}

}  // namespace

void Adversary::attack(World& world, Micros healed, Micros end) {
  cookies_until_ = healed;
  world_ = &world;
  world.on_wire = [this](Micros now, const WireEvent& event) {
    seen_.push_back({now, event.client, event.station, event.to_server, {event.bytes.begin(), event.bytes.end()}});
    if (seen_.size() > kRemembered) seen_.pop_front();
    if (manner_ == Manner::ruthless && kind_of(octets(event.bytes)) == ChannelKind::init && event.to_server)
      answer_init(now, event.station, event.bytes);
  };
  world.on_stray = [this](const ChannelAddress& to, std::span<const std::byte> bytes) {
    counts_.stray_bytes += bytes.size();
    if (thief_ && to == thief_address()) return take(bytes);
    left_[to] -= static_cast<std::int64_t>(bytes.size());
    counts_.overdrawn += left_[to] < 0;
  };
  for (Micros at{3'000}; at < end; at += kEvery) world.at(at, [this, at] { act(at); });
}

ChannelAddress Adversary::random_address() {
  ChannelAddress address = address_of_peer(0xc0000000 + random_.bits() % 5000);
  address.port = static_cast<std::uint16_t>(1000 + random_.bits() % 5000);
  return address;
}

ChannelAddress Adversary::home_or_not(const ChannelAddress& home) { return random_.chance(0.5) ? home : random_address(); }

void Adversary::to_server(const ChannelAddress& from, const Packet& packet) {
  ++counts_.injected;
  counts_.injected_bytes += packet.size();
  left_[from] += static_cast<std::int64_t>(packet.size());
  world_->inject_to_server(from, packet);
}

void Adversary::to_station(std::size_t station, const Packet& packet) {
  ++counts_.injected;
  world_->inject_to_station(station, packet);
}

void Adversary::send(const Seen& like, const Packet& packet) {
  like.to_server ? to_server(like.client, packet) : to_station(like.station, packet);
}

/// Returns a datagram that its receiver has had, or nullptr.
const Adversary::Seen* Adversary::old_one() {
  const auto young = std::partition_point(seen_.begin(), seen_.end(),
                                          [this](const Seen& seen) { return seen.at + kReplayAfter < world_->now(); });
  const auto old = static_cast<std::size_t>(young - seen_.begin());
  return old > 0 ? &seen_[random_.bits() % old] : nullptr;
}

const Adversary::Seen* Adversary::any() { return seen_.empty() ? nullptr : &seen_[random_.bits() % seen_.size()]; }

/// A crashed station is not joined.
bool Adversary::is_in(std::size_t station) const {
  return world_->station(station).up() && world_->station(station).core().link() == LinkState::joined;
}

bool Adversary::all_are_in() const {
  for (std::size_t k = 0; k < world_->stations(); ++k)
    if (!is_in(k)) return false;
  return true;
}

void Adversary::act(Micros now) {
  const bool in = all_are_in();
  const std::uint64_t before = counts_.injected;
  if (stolen_ && in) steal(now);
  if (manner_ == Manner::ruthless)
    act_ruthlessly(in);
  else if (in)
    act_at_random();
  else
    act_before();
  if (!in) counts_.before += counts_.injected - before;
}

void Adversary::act_at_random() {
  const std::uint64_t what = random_.bits() % 6;
  if (what == 5) return flood();
  const Seen* seen = what == 0 ? old_one() : any();
  if (seen == nullptr) return;
  if (what == 0) seen->to_server ? to_server(home_or_not(seen->client), seen->bytes) : to_station(seen->station, seen->bytes);
  if (what == 1) send(*seen, cut(seen->bytes));
  if (what == 2) send(*seen, flipped(seen->bytes));
  if (what == 3) reflect(*seen);
  if (what == 4) send(*seen, forged(seen->bytes));
}

/// A Cookie has no mac, and the mac of an Init is not covered by mac1.
void Adversary::act_before() {
  const std::uint64_t what = random_.bits() % 4;
  if (what == 3) return flood();
  const Seen* seen = any();
  if (seen == nullptr) return;
  if (what == 0) send(*seen, cut(seen->bytes));
  if (what == 1) reflect(*seen);
  const auto kind = kind_of(octets(std::span(seen->bytes)));
  if (what != 2 || kind == ChannelKind::cookie) return;
  Packet packet = seen->bytes;
  const std::size_t signed_bytes = kind == ChannelKind::init ? kInitSigned : packet.size();
  packet[random_.bits() % signed_bytes] ^= static_cast<std::byte>(1 << random_.bits() % 8);
  send(*seen, packet);
}

/// With probability 1/3 replays the handshake sent last, before it arrives. Data that arrive sooner are like a faster network,
/// for which the checks make no allowance.
void Adversary::act_ruthlessly(bool in) {
  if (!in && random_.bits() % 2 == 0) return speak_for_gone();
  const auto last = std::find_if(seen_.rbegin(), seen_.rend(),
                                 [](const Seen& seen) { return kind_of(octets(std::span(seen.bytes))) != ChannelKind::data; });
  if (last == seen_.rend() || random_.bits() % 3 != 0) return in ? act_at_random() : act_before();
  const Seen handshake = *last;
  send(handshake, handshake.bytes);
}

/// Lost datagrams are new to the server, and look as if the station were alive.
void Adversary::speak_for_gone() {
  constexpr int kLooks = 16;
  for (int k = 0; k < kLooks; ++k) {
    const Seen* seen = old_one();
    if (seen == nullptr || !seen->to_server || is_in(seen->station)) continue;
    ++counts_.of_gone;
    return to_server(home_or_not(seen->client), seen->bytes);
  }
}

void Adversary::answer_init(Micros now, std::size_t station, std::span<const std::byte> init) {
  const std::uint32_t index = index_of(octets(init));
  for (std::uint64_t k = random_.bits() % 3; k > 0; --k) {
    Packet cookie(kCookieBytes);
    put_head(octets(std::span(cookie)), ChannelKind::cookie, index);
    for (std::size_t byte = kHeadBytes; byte < cookie.size(); ++byte) cookie[byte] = static_cast<std::byte>(random_.bits());
    const Micros at = now + Micros{1'000} * static_cast<int>(1 + random_.bits() % 200);
    if (at >= cookies_until_) continue;
    world_->at(at, [this, station, cookie] {
      ++counts_.cookies;
      to_station(station, cookie);
    });
  }
}

Adversary::Packet Adversary::cut(const Packet& packet) {
  return {packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(random_.bits() % packet.size())};
}

Adversary::Packet Adversary::flipped(Packet packet) {
  packet[random_.bits() % packet.size()] ^= static_cast<std::byte>(1 << random_.bits() % 8);
  return packet;
}

/// Genuine header, sometimes with another counter, on bytes that nobody sealed.
Adversary::Packet Adversary::forged(Packet packet) {
  for (std::size_t k = kHeadBytes; k < packet.size(); ++k)
    if (k >= kDataHeadBytes || random_.chance(0.3)) packet[k] = static_cast<std::byte>(random_.bits());
  return packet;
}

void Adversary::reflect(const Seen& seen) {
  seen.to_server ? to_station(seen.station, seen.bytes) : to_server(seen.client, seen.bytes);
}

void Adversary::flood() {
  Packet init(kInitBytes);
  for (int k = 0; k < kFlood; ++k) {
    for (std::byte& byte : init) byte = static_cast<std::byte>(random_.bits());
    if (random_.chance(0.5)) {
      put_head(octets(std::span(init)), ChannelKind::init, static_cast<std::uint32_t>(random_.bits()));
      const Mac mac = mac1_of(world_->trust().server_key(), octets(std::span<const std::byte>(init)));
      std::copy(mac.begin(), mac.end(), octets(std::span(init)).begin() + kInitSigned);
    }
    to_server(random_address(), init);
  }
}

void Adversary::steal(Micros now) {
  if (!thief_) thief_ = std::make_unique<ClientChannel>(*stolen_, kWireVersion, draw(), now);
  thief_->tick(now);
  Packet out(kMaxSealedBytes);
  while (const std::size_t size = thief_->emit(octets(std::span(out)), now))
    to_server(thief_address(), {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)});
  if (thief_->ready(now)) say(now);
}

void Adversary::take(std::span<const std::byte> bytes) {
  Packet plain(kMaxDatagramBytes);
  thief_->take(octets(bytes), world_->now(), octets(std::span(plain)));
}

Message Adversary::something_to_say(Micros now) {
  const std::string& victim = world_->station(random_.bits() % world_->stations()).core().welcome().station;
  Message message;
  message.instance = random_.bits();
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
  return message;
}

void Adversary::say(Micros now) {
  const Message message = something_to_say(now);
  Packet plain(kMaxDatagramBytes), sealed(kMaxSealedBytes);
  const std::size_t size = encode(message, plain);
  if (size == 0) return;
  sealed.resize(thief_->seal(octets(std::span<const std::byte>(plain).first(size)), octets(std::span(sealed)), now));
  to_server(random_.chance(0.3) ? victim_address() : thief_address(), sealed);
}

DrawBytes Adversary::draw() {
  return [this](BytesOut out) {
    for (auto& byte : out) byte = static_cast<std::uint8_t>(random_.bits());
  };
}

}  // namespace palpate
