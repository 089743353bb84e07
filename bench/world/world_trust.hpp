// The trust channel in the simulated world: a ClientChannel a station, a ServerTrust for the server.
//
// A station has the key of the person at it, a shadow that of its owner; each life of a station has an address of its own. All
// keys are drawn from the world's seed. Rights: what the station's own Hello asks for, and no more.
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
  /// The first handshake of a life takes no time, so that all the rest happens when it does without keys. Later ones go over the
  /// links of the station.
  bool at_once = true;
  std::map<PublicKey, Rights> more = {};  ///< let in beside the world's stations
};

class WorldTrust {
 public:
  using Packet = std::vector<std::byte>;

  WorldTrust(const WorldKeys& keys, std::uint64_t seed);

  /// Station `k`, the next; `owner`: whose key it has, itself or an earlier one.
  void add_station(std::size_t owner, const std::string& name);
  /// The server reads its keys again: this station's is not there any more.
  void take_out(std::size_t station);
  void new_life(std::size_t station) { clients_[station].channel.reset(); }
  void new_server();

  ClientChannel& client(std::size_t station, Micros own_now);
  ServerTrust& server() { return *server_; }
  const PublicKey& server_key() const { return server_->channel().self(); }
  void shake_hands_at_once(std::size_t station, const ChannelAddress& at, Micros own_now, Micros server_now);
  bool at_once() const { return keys_.at_once; }

  Packet seal_up(std::size_t station, std::span<const std::byte> plain, Micros own_now);
  /// Empty when the session is gone.
  Packet seal_down(ChannelPeer to, std::span<const std::byte> plain, ChannelAddress& address, Micros server_now);
  std::vector<Packet> from_client(std::size_t station, Micros own_now);
  bool next_from_server(Packet& packet, ChannelAddress& to);
  /// What a datagram from the server holds; empty when nothing for the session.
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

/// Of the process with this number.
ChannelAddress address_of_peer(std::uint64_t peer);
/// 0 where it is none of a station's.
std::uint64_t peer_at(const ChannelAddress& address);

}  // namespace palpate
