// Identities on the wire: X25519 key pairs, and Ed25519 pairs for issuers of tokens.
//
// Text form of a key is base64 (RFC 4648, with padding): 44 characters for 32 bytes, as WireGuard writes its keys.
// Randomness is drawn through DrawBytes, so that a simulated world can repeat itself to the bit.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace palpate {

using Bytes = std::span<const std::uint8_t>;
using BytesOut = std::span<std::uint8_t>;
inline constexpr std::size_t kKeyBytes = 32;

/// Returns the same bytes as integers.
template <class Byte, std::size_t n>
auto octets(std::span<Byte, n> bytes) {
  using Octet = std::conditional_t<std::is_const_v<Byte>, const std::uint8_t, std::uint8_t>;
  return std::span<Octet>(reinterpret_cast<Octet*>(bytes.data()), bytes.size());
}

/// Fills the bytes unpredictably; in a simulation from a seed.
using DrawBytes = std::function<void(BytesOut)>;

struct PublicKey {
  std::array<std::uint8_t, kKeyBytes> bytes{};
  auto operator<=>(const PublicKey&) const = default;
};

/// X25519 scalar. Wiped on destruction.
struct SecretKey {
  std::array<std::uint8_t, kKeyBytes> bytes{};
  SecretKey() = default;
  SecretKey(const SecretKey&) = default;
  SecretKey& operator=(const SecretKey&) = default;
  ~SecretKey();
};

/// Ed25519 seed (RFC 8032) of an issuer of tokens. Wiped on destruction.
struct IssuerSecret : SecretKey {};

SecretKey draw_secret(const DrawBytes& draw);
PublicKey public_of(const SecretKey& secret);
PublicKey issuer_of(const IssuerSecret& secret);
/// True when these bytes are a point with which an Ed25519 signature can be checked. One in sixteen X25519 keys also is one.
bool is_issuer(const PublicKey& key);

std::string to_text(Bytes bytes);
inline std::string to_text(const PublicKey& key) { return to_text(Bytes(key.bytes)); }
/// Returns the number of bytes written into `out`; nothing when the text is not base64 or too long.
std::optional<std::size_t> bytes_from(std::string_view text, BytesOut out);
/// Returns nothing when the text is not the 44 characters of a key.
std::optional<PublicKey> key_from(std::string_view text);

/// Draws from the operating system's generator.
DrawBytes system_random();

/// SipHash-2-4 (Aumasson and Bernstein, 2012), 64 bits: without the key nobody can predict a hash or find a collision.
using HashKey = std::array<std::uint64_t, 2>;
std::uint64_t keyed_hash(const HashKey& key, Bytes bytes);

/// Compares in a time that does not depend on where the two differ.
bool same_bytes(Bytes a, Bytes b);
void wipe(BytesOut bytes);

}  // namespace palpate
