// The trust channel in the simulated world: a ClientChannel per station, a ServerTrust for the server.
//
// A station has the key of the person at it, a shadow that of its owner; each life of a station has its own address. All keys are
// drawn from the world's seed. Rights: exactly what the station's own Hello asks for.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/trust/client_channel.hpp"
#include "server/trust/server_trust.hpp"

namespace palpate {

struct WorldKeys {
  ChannelTimes times = {};
  /// true: the first handshake of a life takes no time, so that everything else happens at the same times as without keys. Later
  /// ones go over the links of the station.
  bool at_once = true;
  std::map<PublicKey, Rights> more = {};  ///< admitted in addition to the world's stations
};

class WorldTrust {
 public:
  using Packet = std::vector<std::byte>;

  WorldTrust(const WorldKeys& keys, std::uint64_t seed);

  /// Adds station `k`, the next one; `owner`: station whose key it has, itself or an earlier one.
  void add_station(std::size_t owner, const std::string& name);
  /// The server rereads its keys, without that of this station.
  void take_out(std::size_t station);
  void new_life(std::size_t station) { clients_[station].channel.reset(); }
  void new_server();

  ClientChannel& client(std::size_t station, Micros own_now);
  ServerTrust& server() { return *server_; }
  const PublicKey& server_key() const { return server_->channel().self(); }
  void shake_hands_at_once(std::size_t station, const ChannelAddress& at, Micros own_now, Micros server_now);
  bool at_once() const { return keys_.at_once; }

  Packet seal_up(std::size_t station, std::span<const std::byte> plain, Micros own_now);
  /// Empty if the session is gone.
  Packet seal_down(ChannelPeer to, std::span<const std::byte> plain, ChannelAddress& address, Micros server_now);
  std::vector<Packet> from_client(std::size_t station, Micros own_now);
  bool next_from_server(Packet& packet, ChannelAddress& to);
  /// Opens a datagram from the server; empty if it holds nothing for the session.
  Packet open(std::size_t station, std::span<const std::byte> datagram, Micros own_now);

 private:
  struct Client {
    SecretKey key;
    std::optional<ClientChannel> channel;
  };
  DrawBytes draw(std::uint64_t what) const;

  WorldKeys keys_;
  std::uint64_t seed_, drawn_ = 0;
  SiteKeys site_;
  std::vector<Client> clients_;
  std::unique_ptr<ServerTrust> server_;
};

/// Address of the process with this number.
ChannelAddress address_of_peer(std::uint64_t peer);
/// Number of the process at this address; 0 if it belongs to no station.
std::uint64_t peer_at(const ChannelAddress& address);

}  // namespace palpate
