// The two structures for exchange between threads: order, freshness, and no loss where none is allowed.
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <thread>

#include "common/base/latest_slot.hpp"
#include "common/base/spsc_ring.hpp"

using namespace palpate;

namespace {
/// Wide, so that a torn value would show.
using Wide = std::array<std::uint64_t, 32>;
constexpr std::uint64_t kItems = 100'000;
}  // namespace

TEST_CASE("A slot gives the newest value once") {
  LatestSlot<int> slot;
  CHECK(slot.take() == nullptr);
  for (const int value : {1, 2, 3}) {
    slot.back() = value;
    slot.publish();
  }
  const int* taken = slot.take();
  REQUIRE(taken != nullptr);
  CHECK(*taken == 3);
  CHECK(slot.take() == nullptr);
  slot.back() = 4;
  CHECK(*taken == 3);
  CHECK(slot.take() == nullptr);
  slot.publish();
  CHECK(*slot.take() == 4);
}

TEST_CASE("A slot's reader sees whole values, each newer than the one before, and in the end the last") {
  const auto slot = std::make_unique<LatestSlot<Wide>>();
  std::thread writer([&] {
    for (std::uint64_t k = 1; k <= kItems; ++k) {
      slot->back().fill(k);
      slot->publish();
    }
  });
  std::uint64_t last = 0, torn = 0, older = 0;
  while (last < kItems) {
    const Wide* value = slot->take();
    if (value == nullptr) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t word : *value) torn += word != value->front();
    older += value->front() <= last;
    last = value->front();
  }
  writer.join();
  CHECK(torn == 0);
  CHECK(older == 0);
  CHECK(last == kItems);
}

TEST_CASE("A ring refuses what does not fit and gives back in order") {
  SpscRing<int, 4> ring;
  int value = 0;
  CHECK_FALSE(ring.pop(value));
  for (int lap = 0; lap < 5; ++lap) {
    for (int k = 0; k < 4; ++k) CHECK(ring.push(10 * lap + k));
    CHECK_FALSE(ring.push(99));
    for (int k = 0; k < 4; ++k) {
      CHECK(ring.pop(value));
      CHECK(value == 10 * lap + k);
    }
    CHECK_FALSE(ring.pop(value));
  }
}

TEST_CASE("A ring between two threads loses nothing and keeps the order") {
  const auto ring = std::make_unique<SpscRing<Wide, 64>>();
  std::thread producer([&] {
    Wide item;
    for (std::uint64_t k = 1; k <= kItems; ++k) {
      item.fill(k);
      while (!ring->push(item)) std::this_thread::yield();
    }
  });
  std::uint64_t next = 1, wrong = 0;
  Wide item;
  while (next <= kItems) {
    if (!ring->pop(item)) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t word : item) wrong += word != next;
    ++next;
  }
  producer.join();
  CHECK(wrong == 0);
  CHECK_FALSE(ring->pop(item));
}
