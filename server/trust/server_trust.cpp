#include "server/trust/server_trust.hpp"

namespace palpate {

std::optional<Letter> ServerTrust::take(std::span<const std::byte> datagram, const ChannelAddress& from, Micros now) {
  const auto opened = channel_.take(octets(datagram), from, now, octets(std::span(plain_)));
  if (!opened) return std::nullopt;
  Letter letter{opened->peer, WireFault::none, {}, opened->size, opened->shown, {}};
  letter.fault = decode(std::span(plain_).first(opened->size), letter.message);
  if (letter.fault == WireFault::none)
    letter.ruling = gate_.cap(letter.message, opened->peer, *channel_.key(opened->peer), *channel_.rights(opened->peer), now);
  return letter;
}

std::string ServerTrust::key_of(ChannelPeer peer) const {
  const PublicKey* const key = channel_.key(peer);
  return key == nullptr ? std::string() : std::string(key->bytes.begin(), key->bytes.end());
}

void ServerTrust::forget(ChannelPeer peer) {
  channel_.forget(peer);
  gate_.forget(peer);
}

}  // namespace palpate
