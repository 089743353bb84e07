#include "common/wire/shape_blocks.hpp"

#include <catch2/catch.hpp>
#include <random>

using namespace palpate;

namespace {

std::vector<std::int32_t> draw(std::mt19937& random, std::size_t count, std::int32_t low, std::int32_t high) {
  std::uniform_int_distribution<std::int32_t> number(low, high);
  std::vector<std::int32_t> numbers(count);
  for (auto& n : numbers) n = number(random);
  return numbers;
}

}  // namespace

TEST_CASE("a block comes back as it was, for every width, number of vertices and number of components") {
  std::mt19937 random(2);
  for (const int components : {1, 3})
    for (const std::uint32_t vertices : {1u, 7u, 63u, 64u})
      for (int bits = 0; bits <= kMaxBlockBits; ++bits) {
        const auto reach = static_cast<std::int32_t>((std::int64_t{1} << bits) / 2);
        const auto numbers = draw(random, vertices * static_cast<std::size_t>(components), -std::min(reach, kMaxBlockNumber),
                                  std::min(reach, kMaxBlockNumber));
        std::vector<std::uint8_t> bytes;
        append_block(70'000, numbers, components, bytes);
        REQUIRE(bytes.size() <= kMaxBlockBytes);
        BlockReader reader(bytes, components);
        ShapeBlock block;
        REQUIRE(reader.next(block));
        CHECK(block.index == 70'000);
        CHECK(block.vertices == vertices);
        CHECK(std::equal(numbers.begin(), numbers.end(), block.numbers.begin()));
        CHECK_FALSE(reader.next(block));
        CHECK(reader.ok());
      }
}

TEST_CASE("a block in which all vertices move alike takes its head alone") {
  std::vector<std::int32_t> numbers;
  for (int i = 0; i < 64; ++i) numbers.insert(numbers.end(), {1000, -2000, 300'000});
  std::vector<std::uint8_t> bytes;
  append_block(3, numbers, 3, bytes);
  CHECK(bytes.size() == 16);
}

TEST_CASE("a block that is cut short, or says what cannot be, is not read") {
  std::mt19937 random(4);
  std::vector<std::uint8_t> bytes;
  append_block(1, draw(random, 192, -500, 500), 3, bytes);
  ShapeBlock block;
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    BlockReader reader(std::span<const std::uint8_t>(bytes).first(size), 3);
    REQUIRE_FALSE(reader.next(block));
    REQUIRE_FALSE(reader.ok());
  }
  for (const auto& [at, value] : {std::pair{3, 0}, {3, 65}, {4, 25}}) {  // no vertices, too many, too wide
    auto wrong = bytes;
    wrong[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(value);
    BlockReader reader(wrong, 3);
    CHECK_FALSE(reader.next(block));
  }
  const std::vector<std::uint8_t> beyond{0, 0, 0, 1, 1, 0xff, 0xff, 0x7f, 1};  // the largest number plus one
  BlockReader reader(beyond, 1);
  CHECK_FALSE(reader.next(block));
}
