// The datagrams of the trust channel (docs/reference/wire.md, section 6). Numbers are little-endian.
//
//     Init    C->S  512   kind 1, 0 0 0, client's index 4, Noise first message 96 + 376, mac1 16, cookie 16
//     Cookie  S->C   24   kind 2, 0 0 0, client's index 4, cookie 16
//     Resp    S->C   60   kind 3, 0 0 0, client's index 4, Noise second message 48 + server's index 4
//     Data    both   32+  kind 4, 0 0 0, receiver's index 4, counter 8, sealed payload, tag 16
//     Hint    S->C    8   kind 5, 0 0 0, an index that the server does not know 4
//     Path    both   66   kind 6, else as Data, of 34 bytes: an address of the client's 16, its port 2, cookie 16
//
// The first 8 bytes of an Init are the prologue of its handshake, the first 16 of a Data are authenticated with it: every byte on
// the wire is covered by a tag. mac1 = BLAKE2b-128 of what is before it, keyed with a hash of the server's public key: a sender
// without that key gets no answer. cookie = BLAKE2b-128 of address, port and index, keyed with a secret of the server's: a sender
// that does not receive at its address gets 24 bytes for 512, and makes the server compute nothing else.
//
// Payload of the first message, kInitPayloadBytes: wire version 2, session 8, attempt 4, length of the token 2, token, zeros.
// `session`: drawn by the client once, the same over all its keys; `attempt` grows with every handshake of a session.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "common/base/limits.hpp"
#include "common/trust/keys.hpp"
#include "common/trust/noise_ik.hpp"

namespace palpate {

enum class ChannelKind : std::uint8_t { init = 1, cookie, resp, data, hint, path };

inline constexpr std::size_t kMacBytes = 16, kHeadBytes = 8, kDataHeadBytes = 16;
inline constexpr std::size_t kInitBytes = 512, kCookieBytes = 24, kHintBytes = 8;
inline constexpr std::size_t kInitSigned = kInitBytes - 2 * kMacBytes;  ///< bytes covered by mac1
inline constexpr std::size_t kInitPayloadBytes = kInitSigned - kHeadBytes - kNoiseFirstBytes;
inline constexpr std::size_t kRespBytes = kHeadBytes + kNoiseSecondBytes + 4;
inline constexpr std::size_t kDataOverhead = kDataHeadBytes + kTagBytes;
inline constexpr std::size_t kMaxSealedBytes = kMaxDatagramBytes + kDataOverhead;
inline constexpr std::size_t kPathTextBytes = 16 + 2 + kMacBytes, kPathBytes = kPathTextBytes + kDataOverhead;
inline constexpr std::size_t kMaxTokenBytes = 256;
static_assert(kInitPayloadBytes == 376 && kRespBytes == 60 && kDataOverhead == 32 && kPathBytes == 66);
static_assert(kMaxSealedBytes + 48 <= 1280, "with the heads of IPv6 and UDP every path takes it whole");

using Mac = std::array<std::uint8_t, kMacBytes>;
using PathText = std::array<std::uint8_t, kPathTextBytes>;

/// Source of a datagram: an IPv6 address, or an IPv4 one as ::ffff:a.b.c.d.
struct ChannelAddress {
  std::array<std::uint8_t, 16> ip{};
  std::uint16_t port = 0;
  std::uint32_t scope = 0;  ///< for a link-local address: its interface
  auto operator<=>(const ChannelAddress&) const = default;
};

struct InitPayload {
  std::uint16_t version = 0;
  std::uint64_t session = 0;
  std::uint32_t attempt = 0;
  std::span<const std::uint8_t> token = {};
};

void put_number(BytesOut out, std::uint64_t number);  ///< fills all of `out`
std::uint64_t number_at(Bytes bytes);                 ///< reads all of `bytes`

void put_head(BytesOut out, ChannelKind kind, std::uint32_t index);
/// Returns nothing for a datagram that is too short, has another kind, or lacks the three zeros.
std::optional<ChannelKind> kind_of(Bytes datagram);
inline std::uint32_t index_of(Bytes datagram) { return static_cast<std::uint32_t>(number_at(datagram.subspan(4, 4))); }

std::array<std::uint8_t, kInitPayloadBytes> pack_init(const InitPayload& payload);
/// The token is a view into `bytes`. Returns nothing when its length is invalid.
std::optional<InitPayload> unpack_init(Bytes bytes);

/// Returns the contents of a Path: the address in question, and the cookie sent to it.
PathText pack_path(const ChannelAddress& address, const Mac& cookie);
ChannelAddress address_of_path(Bytes text);
inline Bytes cookie_of_path(Bytes text) { return text.last(kMacBytes); }

/// Returns the key of mac1 for Inits to the server with this public key.
std::array<std::uint8_t, 32> mac1_key_of(const PublicKey& server);
inline Bytes signed_part(Bytes init) { return init.first(kInitSigned); }
/// BLAKE2b-128.
Mac keyed_mac(Bytes key, Bytes text);
inline Mac mac1_of(const PublicKey& server, Bytes init) { return keyed_mac(mac1_key_of(server), signed_part(init)); }

}  // namespace palpate
