#include "common/trust/channel_wire.hpp"

#include <sodium.h>

#include <algorithm>
#include <string_view>

namespace palpate {
namespace {

constexpr std::size_t kTokenAt = 16;  // offset in the payload

}  // namespace

void put_number(BytesOut out, std::uint64_t number) {
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = static_cast<std::uint8_t>(number >> 8 * k);
}

std::uint64_t number_at(Bytes bytes) {
  std::uint64_t number = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) number |= std::uint64_t{bytes[k]} << 8 * k;
  return number;
}

void put_head(BytesOut out, ChannelKind kind, std::uint32_t index) {
  put_number(out.first(4), static_cast<std::uint8_t>(kind));
  put_number(out.subspan(4, 4), index);
}

std::optional<ChannelKind> kind_of(Bytes datagram) {
  if (datagram.size() < kHeadBytes) return std::nullopt;
  const std::uint64_t kind = number_at(datagram.first(4));
  if (kind < static_cast<std::uint64_t>(ChannelKind::init) || kind > static_cast<std::uint64_t>(ChannelKind::path))
    return std::nullopt;
  return static_cast<ChannelKind>(kind);
}

std::array<std::uint8_t, kInitPayloadBytes> pack_init(const InitPayload& payload) {
  std::array<std::uint8_t, kInitPayloadBytes> bytes{};
  const BytesOut out(bytes);
  put_number(out.first(2), payload.version);
  put_number(out.subspan(2, 8), payload.session);
  put_number(out.subspan(10, 4), payload.attempt);
  put_number(out.subspan(14, 2), payload.token.size());
  std::copy(payload.token.begin(), payload.token.end(), bytes.begin() + kTokenAt);
  return bytes;
}

std::optional<InitPayload> unpack_init(Bytes bytes) {
  const auto size = static_cast<std::size_t>(number_at(bytes.subspan(14, 2)));
  if (size > kMaxTokenBytes) return std::nullopt;
  return InitPayload{static_cast<std::uint16_t>(number_at(bytes.first(2))), number_at(bytes.subspan(2, 8)),
                     static_cast<std::uint32_t>(number_at(bytes.subspan(10, 4))), bytes.subspan(kTokenAt, size)};
}

PathText pack_path(const ChannelAddress& address, const Mac& cookie) {
  PathText text;
  std::copy(address.ip.begin(), address.ip.end(), text.begin());
  put_number(BytesOut(text).subspan(16, 2), address.port);
  std::copy(cookie.begin(), cookie.end(), text.begin() + 18);
  return text;
}

ChannelAddress address_of_path(Bytes text) {
  ChannelAddress address;
  std::copy_n(text.begin(), address.ip.size(), address.ip.begin());
  address.port = static_cast<std::uint16_t>(number_at(text.subspan(16, 2)));
  return address;
}

std::array<std::uint8_t, 32> mac1_key_of(const PublicKey& server) {
  constexpr std::string_view kLabel = "palpate mac1";
  std::array<std::uint8_t, 32> key;
  crypto_generichash(key.data(), key.size(), server.bytes.data(), server.bytes.size(),
                     reinterpret_cast<const std::uint8_t*>(kLabel.data()), kLabel.size());
  return key;
}

Mac keyed_mac(Bytes key, Bytes text) {
  Mac mac;
  crypto_generichash(mac.data(), mac.size(), text.data(), text.size(), key.data(), key.size());
  return mac;
}

}  // namespace palpate
