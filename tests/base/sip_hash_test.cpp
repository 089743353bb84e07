#include "common/base/sip_hash.hpp"

#include <array>
#include <catch2/catch.hpp>

using namespace palpate;

TEST_CASE("SipHash gives what its authors give for key 00 .. 0f and messages 00 .. 0e of every length that matters") {
  constexpr SipKey key{0x0706050403020100ull, 0x0f0e0d0c0b0a0908ull};
  std::array<std::uint8_t, 15> message{};
  for (std::size_t k = 0; k < message.size(); ++k) message[k] = static_cast<std::uint8_t>(k);
  const auto of = [&](std::size_t bytes) { return sip_hash(key, std::span(message).first(bytes)); };
  CHECK(of(0) == 0x726fdb47dd0e0e31ull);
  CHECK(of(1) == 0x74f839c593dc67fdull);
  CHECK(of(8) == 0x93f5f5799a932462ull);
  CHECK(of(15) == 0xa129ca6149be45e5ull);
}
