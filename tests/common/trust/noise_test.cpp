// The handshake against results of other implementations: the vector of Noise_IK_25519_ChaChaPoly_SHA512 published by the authors
// of noise-c (tests/vector/noise-c-basic.txt), and key derivation against RFC 8439.
#include <algorithm>
#include <catch2/catch.hpp>

#include "common/trust/noise_ik.hpp"
#include "tests/common/trust/hex.hpp"

using namespace palpate;
using test::from_hex;

namespace {

template <class Key>
Key key_of(std::string_view hex) {
  Key key;
  const auto bytes = from_hex(hex);
  std::copy(bytes.begin(), bytes.end(), key.bytes.begin());
  return key;
}

constexpr std::string_view kPrologue = "50726f6c6f677565313233";
constexpr std::string_view kInitStatic = "e61ef9919cde45dd5f82166404bd08e38bceb5dfdfded0a34c8df7ed542214d1";
constexpr std::string_view kInitEphemeral = "893e28b9dc6ca8d611ab664754b8ceb7bac5117349a4439a6b0569da977c464a";
constexpr std::string_view kServerPublic = "31e0303fd6418d2f8c0e78b91f22e8caed0fbe48656dcf4767e4834f701b8f62";
constexpr std::string_view kRespStatic = "4a3acbfdb163dec651dfa3194dece676d437029c62a408b4c5ea9114246e4893";
constexpr std::string_view kRespEphemeral = "bbdb4cdbd309f1a1f2e1456967fe288cadd6f712d65dc7b7793d5e63da6b375b";
constexpr std::string_view kHash =
    "48d8b650f042c4767cf1f3c26b22ccdd4bc8cff341166603109954eab8a9bd20"
    "915d284b6b618a325e93a8e949a23f4b62ba3094aad0b640c14cbd4f14ccd1e1";

struct VectorMessage {
  std::string_view payload, ciphertext;
};
constexpr VectorMessage kFirst{"4c756477696720766f6e204d69736573",
                               "ca35def5ae56cec33dc2036731ab14896bc4c75dbb07a61f879f8e3afa4c7944"
                               "7a2281c0f1aee0c48c41333a1abbb349ee4bf12e09f8c4fd66635aabbb7dad345826d359e4bd6ebee659f5c6cb3d2d4e"
                               "d12f7c7ffc9fe5513818d9cf9b8778d1502f90649c42ab4a1e3df7199a3d6a13"};
constexpr VectorMessage kSecond{"4d757272617920526f746862617264",
                                "95ebc60d2b1fa672c1f46a8aa265ef51bfe38e7ccb39ec5be34069f144808843"
                                "f58050451a0edd2a40bb8b0f6b51ea63e1f1f429f1afd583e5d6e53f44da1e"};
constexpr VectorMessage kUp{"462e20412e20486179656b", "cae0b6af5460d026e80e22c27572a92048176872538f91a056a8df"};
constexpr VectorMessage kDown{"4361726c204d656e676572", "ab1440d2b5892c638a11a7fa6412beaea5cee62342147f02d75a68"};

std::vector<std::uint8_t> sealed(const SecretKey& key, std::string_view plain) {
  const auto bytes = from_hex(plain);
  std::vector<std::uint8_t> out(bytes.size() + kTagBytes);
  seal_bytes(key, 0, {}, bytes, out);
  return out;
}

struct Pair {
  NoiseInitiator client{key_of<SecretKey>(kInitStatic), key_of<PublicKey>(kServerPublic), key_of<SecretKey>(kInitEphemeral),
                        from_hex(kPrologue)};
  NoiseResponder server{key_of<SecretKey>(kRespStatic), from_hex(kPrologue)};
  std::vector<std::uint8_t> first = std::vector<std::uint8_t>(kNoiseFirstBytes + 16),
                            first_payload{std::vector<std::uint8_t>(16)};
};

}  // namespace

TEST_CASE("a client writes the bytes of the published vector, and derives its keys") {
  Pair pair;
  REQUIRE(pair.client.write(from_hex(kFirst.payload), pair.first));
  CHECK(pair.first == from_hex(kFirst.ciphertext));
  std::vector<std::uint8_t> payload(15);
  REQUIRE(pair.client.read(from_hex(kSecond.ciphertext), payload));
  CHECK(payload == from_hex(kSecond.payload));
  CHECK(std::ranges::equal(pair.client.hash(), from_hex(kHash)));
  const NoiseKeys keys = pair.client.split();
  CHECK(sealed(keys.up, kUp.payload) == from_hex(kUp.ciphertext));
  CHECK(sealed(keys.down, kDown.payload) == from_hex(kDown.ciphertext));
}

TEST_CASE("a server reads the published vector, learns who sent it, and answers with its bytes") {
  Pair pair;
  const auto first = from_hex(kFirst.ciphertext);
  REQUIRE(pair.server.read_sender(first));
  CHECK(pair.server.sender() == public_of(key_of<SecretKey>(kInitStatic)));
  REQUIRE(pair.server.read_payload(first, pair.first_payload));
  CHECK(pair.first_payload == from_hex(kFirst.payload));
  std::vector<std::uint8_t> second(kNoiseSecondBytes + 15);
  REQUIRE(pair.server.write(key_of<SecretKey>(kRespEphemeral), from_hex(kSecond.payload), second));
  CHECK(second == from_hex(kSecond.ciphertext));
  CHECK(std::ranges::equal(pair.server.hash(), from_hex(kHash)));
  const NoiseKeys keys = pair.server.split();
  std::vector<std::uint8_t> plain(11);
  REQUIRE(open_bytes(keys.up, 0, {}, from_hex(kUp.ciphertext), plain));
  CHECK(plain == from_hex(kUp.payload));
}

TEST_CASE("no first message with a flipped bit gets past a server, and none under another prologue") {
  const auto good = from_hex(kFirst.ciphertext);
  std::vector<std::uint8_t> payload(16);
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1 << bit % 8);
    NoiseResponder server(key_of<SecretKey>(kRespStatic), from_hex(kPrologue));
    const bool passed = server.read_sender(bad) && server.read_payload(bad, payload);
    INFO("bit " << bit);
    REQUIRE(!passed);
  }
  NoiseResponder other(key_of<SecretKey>(kRespStatic), from_hex("00"));
  CHECK_FALSE(other.read_sender(good));
}

TEST_CASE("an ephemeral key of a small group, whose shared secret is zero, ends the handshake") {
  auto low = from_hex(kFirst.ciphertext);
  std::fill_n(low.begin(), 32, std::uint8_t{0});
  NoiseResponder server(key_of<SecretKey>(kRespStatic), from_hex(kPrologue));
  CHECK_FALSE(server.read_sender(low));
}

TEST_CASE("sealing is ChaCha20-Poly1305 with the counter little end first behind four zero bytes") {
  // RFC 8439, appendix A.5: nonce 00 00 00 00 01 02 03 04 05 06 07 08.
  const auto key = key_of<SecretKey>("1c9240a5eb55d38af333888604f6b5f0473917c1402b80099dca5cbc207075c0");
  const auto also = from_hex("f33388860000000000004e91");
  const auto sealed = from_hex(
      "64a0861575861af460f062c79be643bd5e805cfd345cf389f108670ac76c8cb24c6cfc18755d43eea09ee94e382d26b0bdb7b73c321b0100d4f03b7f"
      "355894cf332f830e710b97ce98c8a84abd0b948114ad176e008d33bd60f982b1ff37c8559797a06ef4f0ef61c186324e2b3506383606907b6a7c02b0"
      "f9f6157b53c867e4b9166c767b804d46a59b5216cde7a4e99040c5a40433225ee282a1b0a06c523eaf4534d7f83fa1155b0047718cbc546a0d072b04"
      "b3564eea1b422273f548271a0bb2316053fa76991955ebd63159434ecebb4e466dae5a1073a6727627097a1049e617d91d361094fa68f0ff77987130"
      "305beaba2eda04df997b714d6c6f2c29a6ad5cb4022b02709beead9d67890cbb22392336fea1851f38");
  std::vector<std::uint8_t> plain(sealed.size() - kTagBytes);
  REQUIRE(open_bytes(key, 0x0807060504030201, also, sealed, plain));
  const std::string_view text = "Internet-Drafts are draft documents valid for a maximum of six months";
  CHECK(std::equal(text.begin(), text.end(), plain.begin()));
}
