#include "common/base/sort_stably.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace palpate {
namespace {

/// As wide as a vector register; counts misaligned instances.
struct alignas(64) Wide {
  Wide(int k, std::size_t p) : key(k), place(p) { see(); }
  Wide(Wide&& other) noexcept : key(other.key), place(other.place) { see(); }
  Wide(const Wide& other) : key(other.key), place(other.place) { see(); }
  Wide& operator=(Wide&&) = default;
  Wide& operator=(const Wide&) = default;
  void see() const { misplaced += reinterpret_cast<std::uintptr_t>(this) % alignof(Wide) != 0; }

  int key;
  std::size_t place;
  static inline int misplaced = 0;
};

TEST_CASE("items of any alignment are sorted, lie aligned all the time, and equal ones keep their order") {
  std::mt19937 random(7);
  std::vector<std::vector<char>> between;  // allocations of other sizes that vary the addresses
  Wide::misplaced = 0;
  for (const std::size_t count : {0, 1, 2, 3, 17, 100, 1000}) {
    between.emplace_back(16 * count + 8);
    std::vector<Wide> items;
    for (std::size_t k = 0; k < count; ++k) items.emplace_back(static_cast<int>(random() % 10), k);
    sort_stably(items.begin(), items.end(), [](const Wide& a, const Wide& b) { return a.key < b.key; });
    REQUIRE(items.size() == count);
    for (std::size_t k = 1; k < count; ++k)
      CHECK(std::pair(items[k - 1].key, items[k - 1].place) < std::pair(items[k].key, items[k].place));
  }
  CHECK(Wide::misplaced == 0);
}

TEST_CASE("a part of a range is sorted by itself") {
  std::vector<int> numbers{9, 3, 1, 2, 0};
  sort_stably(numbers.begin() + 1, numbers.end() - 1, [](int a, int b) { return a < b; });
  CHECK(numbers == std::vector<int>{9, 1, 2, 3, 0});
}

}  // namespace
}  // namespace palpate
