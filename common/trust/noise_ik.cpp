#include "common/trust/noise_ik.hpp"

#include <sodium.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace palpate {
namespace {

constexpr std::string_view kProtocol = "Noise_IK_25519_ChaChaPoly_SHA512";
constexpr std::size_t kSealedKeyBytes = kKeyBytes + kTagBytes;
using Block = std::array<std::uint8_t, kHashBytes>;

Block hmac(Bytes key, Bytes first, Bytes second = {}) {
  crypto_auth_hmacsha512_state state;
  crypto_auth_hmacsha512_init(&state, key.data(), key.size());
  crypto_auth_hmacsha512_update(&state, first.data(), first.size());
  crypto_auth_hmacsha512_update(&state, second.data(), second.size());
  Block out;
  crypto_auth_hmacsha512_final(&state, out.data());
  wipe({reinterpret_cast<std::uint8_t*>(&state), sizeof state});
  return out;
}

/// Returns both outputs of HKDF, Noise section 4.3.
std::pair<Block, Block> hkdf(const Block& chain, Bytes input) {
  constexpr std::uint8_t kOne = 1, kTwo = 2;
  Block secret = hmac(chain, input);
  const Block first = hmac(secret, {&kOne, 1});
  const Block second = hmac(secret, first, {&kTwo, 1});
  wipe(secret);
  return {first, second};
}

/// Copies the first half, the key of a cipher.
void take_half(const Block& block, SecretKey& key) { std::copy_n(block.begin(), kKeyBytes, key.bytes.begin()); }

std::array<std::uint8_t, 12> nonce_of(std::uint64_t counter) {
  std::array<std::uint8_t, 12> nonce{};
  for (std::size_t k = 0; k < 8; ++k) nonce[4 + k] = static_cast<std::uint8_t>(counter >> 8 * k);
  return nonce;
}

PublicKey key_at(Bytes message) {
  PublicKey key;
  std::copy_n(message.begin(), kKeyBytes, key.bytes.begin());
  return key;
}

}  // namespace

void seal_bytes(const SecretKey& key, std::uint64_t counter, Bytes also, Bytes plain, BytesOut out) {
  const auto nonce = nonce_of(counter);
  crypto_aead_chacha20poly1305_ietf_encrypt(out.data(), nullptr, plain.data(), plain.size(), also.data(), also.size(), nullptr,
                                            nonce.data(), key.bytes.data());
}

bool open_bytes(const SecretKey& key, std::uint64_t counter, Bytes also, Bytes sealed, BytesOut out) {
  const auto nonce = nonce_of(counter);
  return crypto_aead_chacha20poly1305_ietf_decrypt(out.data(), nullptr, nullptr, sealed.data(), sealed.size(), also.data(),
                                                   also.size(), nonce.data(), key.bytes.data()) == 0;
}

NoiseState::NoiseState(Bytes prologue) {
  std::copy(kProtocol.begin(), kProtocol.end(), hash_.begin());  // shorter than a hash: padded with zeros
  chain_ = hash_;
  mix_hash(prologue);
}

void NoiseState::mix_hash(Bytes bytes) {
  crypto_hash_sha512_state state;
  crypto_hash_sha512_init(&state);
  crypto_hash_sha512_update(&state, hash_.data(), hash_.size());
  crypto_hash_sha512_update(&state, bytes.data(), bytes.size());
  crypto_hash_sha512_final(&state, hash_.data());
}

bool NoiseState::mix_dh(const SecretKey& secret, const PublicKey& other) {
  SecretKey shared;
  if (crypto_scalarmult(shared.bytes.data(), secret.bytes.data(), other.bytes.data()) != 0) return false;
  auto [chain, key] = hkdf(chain_, shared.bytes);
  chain_ = chain;
  take_half(key, key_);
  wipe(key);
  sealed_ = 0;
  return true;
}

void NoiseState::seal(Bytes plain, BytesOut out) {
  seal_bytes(key_, sealed_++, hash_, plain, out);
  mix_hash(out);
}

bool NoiseState::open(Bytes sealed, BytesOut out) {
  if (!open_bytes(key_, sealed_++, hash_, sealed, out)) return false;
  mix_hash(sealed);
  return true;
}

NoiseKeys NoiseState::split() const {
  auto [up, down] = hkdf(chain_, {});
  NoiseKeys keys;
  take_half(up, keys.up);
  take_half(down, keys.down);
  wipe(up);
  wipe(down);
  return keys;
}

NoiseInitiator::NoiseInitiator(const SecretKey& self, const PublicKey& server, const SecretKey& ephemeral, Bytes prologue)
    : self_(self), ephemeral_(ephemeral), server_(server), state_(prologue) {
  state_.mix_hash(server.bytes);
}

bool NoiseInitiator::write(Bytes payload, BytesOut out) {
  const PublicKey ephemeral = public_of(ephemeral_);
  std::copy(ephemeral.bytes.begin(), ephemeral.bytes.end(), out.begin());
  state_.mix_hash(ephemeral.bytes);
  if (!state_.mix_dh(ephemeral_, server_)) return false;
  state_.seal(public_of(self_).bytes, out.subspan(kKeyBytes, kSealedKeyBytes));
  if (!state_.mix_dh(self_, server_)) return false;
  state_.seal(payload, out.subspan(kKeyBytes + kSealedKeyBytes, payload.size() + kTagBytes));
  return true;
}

bool NoiseInitiator::read(Bytes message, BytesOut payload) {
  if (message.size() != kNoiseSecondBytes + payload.size()) return false;
  const PublicKey ephemeral = key_at(message);
  state_.mix_hash(ephemeral.bytes);
  return state_.mix_dh(ephemeral_, ephemeral) && state_.mix_dh(self_, ephemeral) &&
         state_.open(message.subspan(kKeyBytes), payload);
}

NoiseResponder::NoiseResponder(const SecretKey& self, const PublicKey& own, Bytes prologue) : self_(self), state_(prologue) {
  state_.mix_hash(own.bytes);
}

bool NoiseResponder::read_sender(Bytes message) {
  if (message.size() < kNoiseFirstBytes) return false;
  sender_ephemeral_ = key_at(message);
  state_.mix_hash(sender_ephemeral_.bytes);
  return state_.mix_dh(self_, sender_ephemeral_) && state_.open(message.subspan(kKeyBytes, kSealedKeyBytes), sender_.bytes);
}

bool NoiseResponder::read_payload(Bytes message, BytesOut payload) {
  if (message.size() != kNoiseFirstBytes + payload.size()) return false;
  return state_.mix_dh(self_, sender_) && state_.open(message.subspan(kKeyBytes + kSealedKeyBytes), payload);
}

bool NoiseResponder::write(const SecretKey& ephemeral, Bytes payload, BytesOut out) {
  const PublicKey own = public_of(ephemeral);
  std::copy(own.bytes.begin(), own.bytes.end(), out.begin());
  state_.mix_hash(own.bytes);
  if (!state_.mix_dh(ephemeral, sender_ephemeral_) || !state_.mix_dh(ephemeral, sender_)) return false;
  state_.seal(payload, out.subspan(kKeyBytes, payload.size() + kTagBytes));
  return true;
}

}  // namespace palpate
