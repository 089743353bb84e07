#include "server/core/timeline.hpp"

#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("instants of samples go back exactly although the offset moved meanwhile") {
  Timeline line;
  for (int i = 0; i < 500; ++i) line.add({1s + i * 1ms, Vec3::Zero()}, 9s + i * 1ms + Micros{i / 7});
  for (int i = 0; i < 500; ++i) CHECK(line.to_station(9s + i * 1ms + Micros{i / 7}) == 1s + i * 1ms);
}

TEST_CASE("between samples the clocks are related linearly, outside by the offset of the end") {
  Timeline line;
  line.add({10ms, Vec3::Zero()}, 1010ms);
  line.add({20ms, Vec3::Zero()}, 1030ms);
  CHECK(line.to_station(1020ms) == 15ms);
  CHECK(line.to_station(1000ms) == 0ms);
  CHECK(line.to_station(1050ms) == 40ms);
}

TEST_CASE("repeats and late samples are not taken, and server times ascend strictly") {
  Timeline line;
  CHECK(line.add({10ms, Vec3::Zero()}, 100ms));
  CHECK_FALSE(line.add({10ms, Vec3::Zero()}, 105ms));
  CHECK_FALSE(line.add({9ms, Vec3::Zero()}, 105ms));
  CHECK(line.add({11ms, Vec3::Zero()}, 99ms));
  CHECK(line.newest() == 100ms + 1us);
  CHECK(line.size() == 2);
}

TEST_CASE("the samples of a frame enclose it") {
  Timeline line;
  for (int i = 0; i < 10; ++i) line.add({i * 1ms, Vec3(i, 0, 0)}, 100ms + i * 1ms);
  const auto samples = line.between(103500us, 106500us);
  REQUIRE(samples.size() == 5);
  CHECK(samples.front().t == 103ms);
  CHECK(samples.front().position.x() == 3);
  CHECK(samples.back().t == 107ms);
  CHECK(line.between(200ms, 300ms).size() == 1);
  CHECK(line.between(0ms, 1ms).size() == 1);
}

TEST_CASE("forgetting keeps the last sample and memory is bounded") {
  Timeline line;
  for (int i = 0; i < 3 * static_cast<int>(Timeline::kMost); ++i) line.add({i * 1ms, Vec3::Zero()}, i * 1ms);
  CHECK(line.size() == Timeline::kMost);
  line.forget_before(1h);
  CHECK(line.size() == 1);
}

TEST_CASE("samples closer than a quarter of a tick to the one before are left out") {
  Timeline line;
  for (int i = 0; i < 4000; ++i) line.add({i * 10us, Vec3::Zero()}, 1s + i * 10us);  // 40 ms
  CHECK(line.size() == 160);
  CHECK(line.add({1s, Vec3::Zero()}, 2s));
  CHECK_FALSE(line.add({1s + 249us, Vec3::Zero()}, 2s + 249us));
  CHECK(line.add({1s + 250us, Vec3::Zero()}, 2s + 250us));
}
