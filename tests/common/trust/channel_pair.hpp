// A client and a server of the trust channel, connected only by the datagrams that a test passes on.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "common/base/random.hpp"
#include "common/trust/client_channel.hpp"
#include "common/trust/server_channel.hpp"

namespace palpate::test {

using Datagram = std::vector<std::uint8_t>;

inline DrawBytes seeded(std::uint64_t seed) {
  return [random = std::make_shared<Random>(seed)](BytesOut out) {
    for (auto& byte : out) byte = static_cast<std::uint8_t>(random->bits());
  };
}

inline SecretKey secret_of(std::uint64_t seed) { return draw_secret(seeded(seed)); }

inline Rights rights_of(const std::string& name) {
  Rights rights;
  rights.name = name;
  rights.hand = rights.viewer = true;
  return rights;
}

inline ChannelAddress address_of(int host, int port) {
  ChannelAddress address;
  address.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 10, 0, 0, static_cast<std::uint8_t>(host)};
  address.port = static_cast<std::uint16_t>(port);
  return address;
}

inline constexpr std::uint64_t kServerSeed = 1, kStationSeed = 2, kStrangerSeed = 3;

inline SiteKeys site_keys() {
  SiteKeys keys;
  keys.self = secret_of(kServerSeed);
  keys.stations[public_of(secret_of(kStationSeed))] = rights_of("OR 3");
  return keys;
}

inline ClientKeys client_keys(std::uint64_t station = kStationSeed, std::uint64_t server = kServerSeed) {
  return {secret_of(station), public_of(secret_of(server)), {}};
}

struct ChannelPair {
  explicit ChannelPair(const SiteKeys& site = site_keys(), const ClientKeys& keys = client_keys(), std::uint64_t seed = 7,
                       const ChannelTimes& times = {})
      : server(
            site, seeded(seed), [this] { return unix_s; }, times),
        client(keys, 5, seeded(seed + 100), now, times) {}

  /// All datagrams that the client's channel wants to send now.
  std::vector<Datagram> from_client() {
    client.tick(now);
    std::vector<Datagram> all;
    Datagram out(kMaxSealedBytes);
    while (const std::size_t size = client.emit(out, now)) all.emplace_back(out.begin(), out.begin() + static_cast<long>(size));
    return all;
  }
  /// All answers of the server's channel.
  std::vector<Datagram> from_server() {
    std::vector<Datagram> all;
    Datagram out(kMaxSealedBytes);
    while (const std::size_t size = server.emit(out, to)) all.emplace_back(out.begin(), out.begin() + static_cast<long>(size));
    return all;
  }
  std::optional<ServerChannel::Opened> to_server(const Datagram& datagram) { return server.take(datagram, from, now, plain); }
  std::size_t to_client(const Datagram& datagram) { return client.take(datagram, now, plain); }
  Datagram sealed(const std::string& text) {
    Datagram out(text.size() + kDataOverhead);
    out.resize(client.seal({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, out, now));
    return out;
  }
  Datagram sealed_by_server(ChannelPeer peer, const std::string& text) {
    Datagram out(text.size() + kDataOverhead);
    out.resize(server.seal(peer, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, out, to, now));
    return out;
  }
  std::string text(std::size_t size) const { return {plain.begin(), plain.begin() + static_cast<long>(size)}; }

  /// Performs an undisturbed handshake; the caller sends the first Data.
  bool shake_hands() {
    for (int round = 0; round < 2; ++round) {
      for (const Datagram& datagram : from_client()) to_server(datagram);
      for (const Datagram& datagram : from_server()) to_client(datagram);
    }
    return client.ready(now);
  }
  /// Performs a handshake with the first Data; returns its session.
  ChannelPeer join() {
    if (!shake_hands()) return 0;
    const auto opened = to_server(sealed("hello"));
    return opened ? opened->peer : 0;
  }

  Micros now{1'000'000};
  std::int64_t unix_s = 1'800'000'000;
  ChannelAddress from = address_of(1, 4711), to;
  Datagram plain = Datagram(kMaxSealedBytes);
  ServerChannel server;
  ClientChannel client;
};

inline Datagram with_mac(Datagram init, std::uint64_t server = kServerSeed) {
  const Mac mac = mac1_of(public_of(secret_of(server)), init);
  std::copy(mac.begin(), mac.end(), init.begin() + kInitSigned);
  return init;
}

}  // namespace palpate::test
