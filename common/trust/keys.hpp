// Who somebody is on the wire: an X25519 key pair. And an Ed25519 pair for those who issue tokens.
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

/// The same bytes, as numbers.
template <class Byte, std::size_t n>
auto octets(std::span<Byte, n> bytes) {
  using Octet = std::conditional_t<std::is_const_v<Byte>, const std::uint8_t, std::uint8_t>;
  return std::span<Octet>(reinterpret_cast<Octet*>(bytes.data()), bytes.size());
}

/// Fills the bytes with what nobody can guess; in a simulation with what a seed says.
using DrawBytes = std::function<void(BytesOut)>;

struct PublicKey {
  std::array<std::uint8_t, kKeyBytes> bytes{};
  auto operator<=>(const PublicKey&) const = default;
};

/// X25519 scalar. Wiped when it goes.
struct SecretKey {
  std::array<std::uint8_t, kKeyBytes> bytes{};
  SecretKey() = default;
  SecretKey(const SecretKey&) = default;
  SecretKey& operator=(const SecretKey&) = default;
  ~SecretKey();
};

/// Ed25519 seed (RFC 8032) of one who issues tokens. Wiped when it goes.
struct IssuerSecret : SecretKey {};

SecretKey draw_secret(const DrawBytes& draw);
PublicKey public_of(const SecretKey& secret);
PublicKey issuer_of(const IssuerSecret& secret);
/// Whether these bytes are a point that an Ed25519 signature can be checked with. Of X25519 keys one in sixteen looks like one.
bool is_issuer(const PublicKey& key);

std::string to_text(Bytes bytes);
inline std::string to_text(const PublicKey& key) { return to_text(Bytes(key.bytes)); }
/// Bytes written into `out`; nothing when the text is not base64 or says more than fits.
std::optional<std::size_t> bytes_from(std::string_view text, BytesOut out);
/// Nothing when it is not the 44 characters of a key.
std::optional<PublicKey> key_from(std::string_view text);

/// From the operating system's generator.
DrawBytes system_random();

/// SipHash-2-4 (Aumasson and Bernstein, 2012), 64 bits: who does not know the key can neither say the hash of anything nor find
/// two inputs of the same.
using HashKey = std::array<std::uint64_t, 2>;
std::uint64_t keyed_hash(const HashKey& key, Bytes bytes);

/// Compares in a time that says nothing of where the two differ.
bool same_bytes(Bytes a, Bytes b);
void wipe(BytesOut bytes);

}  // namespace palpate
