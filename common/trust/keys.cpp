#include "common/trust/keys.hpp"

#include <sodium.h>

#include <algorithm>
#include <bit>
#include <stdexcept>

namespace palpate {
namespace {

/// Lets the library select the code for this processor once; without it everything still works, more slowly.
const bool sodium_ready = sodium_init() >= 0;

}  // namespace

SecretKey::~SecretKey() { wipe(bytes); }

SecretKey draw_secret(const DrawBytes& draw) {
  SecretKey secret;
  draw(secret.bytes);
  return secret;
}

PublicKey public_of(const SecretKey& secret) {
  PublicKey key;
  crypto_scalarmult_base(key.bytes.data(), secret.bytes.data());
  return key;
}

PublicKey issuer_of(const IssuerSecret& secret) {
  PublicKey key;
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> whole;
  crypto_sign_seed_keypair(key.bytes.data(), whole.data(), secret.bytes.data());
  wipe(whole);
  return key;
}

bool is_issuer(const PublicKey& key) { return crypto_core_ed25519_is_valid_point(key.bytes.data()) == 1; }

std::string to_text(Bytes bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();  // terminating zero
  return text;
}

std::optional<std::size_t> bytes_from(std::string_view text, BytesOut out) {
  std::size_t size = 0;
  const char* end = nullptr;
  if (sodium_base642bin(out.data(), out.size(), text.data(), text.size(), nullptr, &size, &end, sodium_base64_VARIANT_ORIGINAL) !=
          0 ||
      end != text.data() + text.size())
    return std::nullopt;
  return size;
}

std::optional<PublicKey> key_from(std::string_view text) {
  PublicKey key;
  const auto size = bytes_from(text, key.bytes);
  if (!size || *size != kKeyBytes) return std::nullopt;
  return key;
}

DrawBytes system_random() {
  if (!sodium_ready) throw std::runtime_error("the operating system gives no random numbers");
  return [](BytesOut out) { randombytes_buf(out.data(), out.size()); };
}

std::uint64_t keyed_hash(const HashKey& key, Bytes bytes) {
  static_assert(std::endian::native == std::endian::little && sizeof(HashKey) == crypto_shorthash_KEYBYTES);
  std::array<std::uint8_t, crypto_shorthash_BYTES> hash;
  crypto_shorthash(hash.data(), bytes.data(), bytes.size(), reinterpret_cast<const std::uint8_t*>(key.data()));
  return std::bit_cast<std::uint64_t>(hash);
}

bool same_bytes(Bytes a, Bytes b) { return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0; }
void wipe(BytesOut bytes) { sodium_memzero(bytes.data(), bytes.size()); }

}  // namespace palpate
