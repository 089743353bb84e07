// A server that knows its stations by their keys: datagrams of the channel in, messages for the rooms out, and back.
#pragma once

#include "common/wire/codec.hpp"
#include "server/trust/rights_gate.hpp"

namespace palpate {

/// A message that came through the channel, its asking cut down to what the sender may.
struct Letter {
  ChannelPeer from = 0;
  WireFault fault = WireFault::none;
  Message message;
  std::size_t size = 0;
  bool shown = true;  ///< of ServerChannel::Opened
  Ruling ruling;      ///< refused: in place of an answer from the room
};

class ServerTrust {
 public:
  ServerTrust(SiteKeys keys, DrawBytes draw, ServerChannel::UnixSeconds unix_now, const ChannelTimes& times = {})
      : channel_(std::move(keys), std::move(draw), std::move(unix_now), times) {}

  std::optional<Letter> take(std::span<const std::byte> datagram, const ChannelAddress& from, Micros now);
  /// What a room says to a session, sealed into `out` (kMaxSealedBytes); 0 when that is gone.
  std::size_t seal(ChannelPeer to, std::span<const std::byte> plain, std::span<std::byte> out, ChannelAddress& address,
                   Micros now) {
    return channel_.seal(to, octets(plain), octets(out), address, now);
  }
  /// After the rooms have said what they had to say to a session that ended.
  void forget(ChannelPeer peer);
  /// Whether both are there with one key, and the first is the newer session.
  bool succeeds(ChannelPeer newer, ChannelPeer older) const;
  ServerChannel& channel() { return channel_; }
  const ServerChannel& channel() const { return channel_; }

 private:
  ServerChannel channel_;
  RightsGate gate_;
  std::array<std::byte, kMaxDatagramBytes> plain_{};
};

}  // namespace palpate
