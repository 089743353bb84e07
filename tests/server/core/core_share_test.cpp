#include "server/io/core_share.hpp"

#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("The share of a core is processor time over time on the wall, of frames long and short alike") {
  CoreShare share;
  CHECK(share.share() == 1);
  CHECK_FALSE(share.starved());
  for (int k = 0; k < 200; ++k) share.add(k % 2 ? 10ms : 40ms, k % 2 ? 30ms : 120ms);
  CHECK(share.share() == Approx(1.0 / 3));
  CHECK(share.starved());
}

TEST_CASE("A machine that becomes free is said to be so after a few seconds of computing, one frame that waits changes little") {
  CoreShare share;
  for (int k = 0; k < 50; ++k) share.add(10ms, 50ms);
  Micros busy{};
  for (; share.starved(); busy += 20ms) share.add(20ms, 20ms);
  CHECK(busy < 3s);
  for (int k = 0; k < 100; ++k) share.add(20ms, 20ms);
  share.add(20ms, 100ms);
  CHECK_FALSE(share.starved());
}
