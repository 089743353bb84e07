#include <catch2/catch.hpp>
#include <random>

#include "tests/client/device/hid/try_hid.hpp"

TEST_CASE("Devices with damaged descriptors and reports are refused or read within bounds", "[hid]") {
  std::mt19937 random(11);
  const auto descriptors = palpate::test::known_descriptors();
  const auto words = palpate::test::known_words();
  for (const auto& whole : descriptors) REQUIRE(palpate::test::try_hid(whole, words) >= 1);
  int taken = 0, tried = 0;
  for (; tried < 4000; ++tried) {
    auto bytes = descriptors[random() % descriptors.size()];
    auto said = words;
    for (auto n = random() % 4; n > 0; --n) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    for (auto n = random() % 3; n > 0; --n) said[random() % said.size()] = static_cast<std::byte>(random());
    taken += palpate::test::try_hid(bytes, said) > 0;
  }
  CHECK(taken > tried / 10);  // harmless damage
}
