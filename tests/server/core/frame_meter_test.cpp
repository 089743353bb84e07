#include "server/core/frame_meter.hpp"

#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("what frames cost is that of the last second, and nothing once there were none in it") {
  FrameMeter meter;
  CHECK(meter.at(5s).frames == 0);
  CHECK(meter.at(5s).real_time_factor == 0);
  for (int k = 0; k < 10; ++k) meter.add(10s + k * 50ms, 40ms, 50ms);  // slow ones, long ago
  for (int k = 0; k < 20; ++k) meter.add(12s + k * 50ms, 10ms, 50ms);
  const auto now = meter.at(12950ms);
  CHECK(now.frames == 20);
  CHECK(now.took_mean == 10ms);
  CHECK(now.real_time_factor == Approx(5));
  CHECK(meter.at(13400ms).frames == 11);
  CHECK(meter.at(13400ms).took_mean == 10ms);
  CHECK(meter.at(13950ms).frames == 0);
  CHECK(meter.at(13950ms).took_mean == 0ms);
}
