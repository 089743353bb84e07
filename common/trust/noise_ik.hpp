// The handshake Noise_IK_25519_ChaChaPoly_SHA512 (Perrin, "The Noise Protocol Framework", revision 34, 2018) on libsodium.
//
//     <- s                          the client knows the server's public key beforehand
//     -> e, es, s, ss   payload     32 + 48 + payload + 16 bytes
//     <- e, ee, se      payload     32 + payload + 16 bytes
//
// e, s: ephemeral and static keys; es etc.: X25519 of initiator's and responder's. Each DH enters a chaining key by HKDF-SHA512
// (RFC 5869 with an empty info), and each byte sent enters a hash that every ciphertext authenticates, so a change of any byte,
// the prologue included, ends the handshake. After the second message both have the same two keys, one a direction, which nobody
// can compute later even with both static secrets (forward secrecy).
//
// All calls return false, and the object must be discarded, when a tag is wrong or a DH gives zero.
#pragma once

#include <array>
#include <cstdint>

#include "common/trust/keys.hpp"

namespace palpate {

inline constexpr std::size_t kTagBytes = 16, kHashBytes = 64;
inline constexpr std::size_t kNoiseFirstBytes = 32 + 48 + kTagBytes;  ///< size of the first message without its payload
inline constexpr std::size_t kNoiseSecondBytes = 32 + kTagBytes;      ///< size of the second

/// ChaCha20-Poly1305 (RFC 8439), nonce: four zero bytes, then the counter, little-endian. `out` has room for the tag too.
void seal_bytes(const SecretKey& key, std::uint64_t counter, Bytes also, Bytes plain, BytesOut out);
/// Returns false, with `out` undefined, when the tag is wrong. `out`: as many bytes as `sealed` without the tag.
[[nodiscard]] bool open_bytes(const SecretKey& key, std::uint64_t counter, Bytes also, Bytes sealed, BytesOut out);

/// The keys of one session, by direction.
struct NoiseKeys {
  SecretKey up, down;  ///< initiator to responder, and back
};

/// The common state of both sides: chaining key, hash, and the key of the next ciphertext.
class NoiseState {
 public:
  explicit NoiseState(Bytes prologue);
  void mix_hash(Bytes bytes);
  [[nodiscard]] bool mix_dh(const SecretKey& secret, const PublicKey& other);
  void seal(Bytes plain, BytesOut out);
  [[nodiscard]] bool open(Bytes sealed, BytesOut out);
  NoiseKeys split() const;
  const std::array<std::uint8_t, kHashBytes>& hash() const { return hash_; }

 private:
  std::array<std::uint8_t, kHashBytes> chain_{}, hash_{};
  SecretKey key_;
  std::uint64_t sealed_ = 0;  ///< number of ciphertexts with this key
};

class NoiseInitiator {
 public:
  NoiseInitiator(const SecretKey& self, const PublicKey& server, const SecretKey& ephemeral, Bytes prologue);
  /// `out`: kNoiseFirstBytes and the payload.
  [[nodiscard]] bool write(Bytes payload, BytesOut out);
  /// `payload`: as many bytes as the message without kNoiseSecondBytes.
  [[nodiscard]] bool read(Bytes message, BytesOut payload);
  NoiseKeys split() const { return state_.split(); }
  const std::array<std::uint8_t, kHashBytes>& hash() const { return state_.hash(); }

 private:
  SecretKey self_, ephemeral_;
  PublicKey server_;
  NoiseState state_;
};

class NoiseResponder {
 public:
  NoiseResponder(const SecretKey& self, Bytes prologue) : NoiseResponder(self, public_of(self), prologue) {}
  /// `own`: public key of `self`, which costs as much as a DH to compute.
  NoiseResponder(const SecretKey& self, const PublicKey& own, Bytes prologue);
  /// Reads the first message up to the sender's static key. A server that does not know that key has spent one DH, and stops.
  [[nodiscard]] bool read_sender(Bytes message);
  /// The claimed public key; its ownership is proven only after read_payload().
  const PublicKey& sender() const { return sender_; }
  [[nodiscard]] bool read_payload(Bytes message, BytesOut payload);
  [[nodiscard]] bool write(const SecretKey& ephemeral, Bytes payload, BytesOut out);
  NoiseKeys split() const { return state_.split(); }
  const std::array<std::uint8_t, kHashBytes>& hash() const { return state_.hash(); }

 private:
  SecretKey self_;
  PublicKey sender_, sender_ephemeral_;
  NoiseState state_;
};

}  // namespace palpate
