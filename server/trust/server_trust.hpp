// Server that identifies stations by their keys: converts datagrams of the channel to messages for the rooms and back.
#pragma once

#include "common/wire/codec.hpp"
#include "server/trust/rights_gate.hpp"

namespace palpate {

/// A message that came through the channel, reduced to the rights of its sender.
struct Letter {
  ChannelPeer from = 0;
  WireFault fault = WireFault::none;
  Message message;
  std::size_t size = 0;
  bool shown = true;  ///< see ServerChannel::Opened
  Ruling ruling;      ///< `refused` is sent in place of an answer from the room
};

class ServerTrust {
 public:
  ServerTrust(SiteKeys keys, DrawBytes draw, ServerChannel::UnixSeconds unix_now, const ChannelTimes& times = {})
      : channel_(std::move(keys), std::move(draw), std::move(unix_now), times) {}

  std::optional<Letter> take(std::span<const std::byte> datagram, const ChannelAddress& from, Micros now);
  /// Seals a room's datagram for a session into `out` (kMaxSealedBytes); returns 0 if the session is gone.
  std::size_t seal(ChannelPeer to, std::span<const std::byte> plain, std::span<std::byte> out, ChannelAddress& address,
                   Micros now) {
    return channel_.seal(to, octets(plain), octets(out), address, now);
  }
  /// Forgets an ended session; call after the rooms have sent their last messages to it.
  void forget(ChannelPeer peer);
  /// Returns the bytes of a session's public key; none if it is gone.
  std::string key_of(ChannelPeer peer) const;
  ServerChannel& channel() { return channel_; }
  const ServerChannel& channel() const { return channel_; }

 private:
  ServerChannel channel_;
  RightsGate gate_;
  std::array<std::byte, kMaxDatagramBytes> plain_{};
};

}  // namespace palpate
