#include <catch2/catch.hpp>

#include "common/base/minimum_jerk.hpp"

using namespace palpate;

TEST_CASE("The curve of least jerk begins and ends at rest, and its slope is that of differences") {
  CHECK(minimum_jerk(-0.3) == 0);
  CHECK(minimum_jerk(1.7) == 1);
  for (double c = 0; c <= 1; c += 0.0625) {
    constexpr double kStep = 1e-5;
    CHECK(minimum_jerk(c) + minimum_jerk(1 - c) == Approx(1));
    CHECK(minimum_jerk_rate(c) == Approx((minimum_jerk(c + kStep) - minimum_jerk(c - kStep)) / (2 * kStep)).margin(1e-8));
  }
  for (const double end : {0.0, 1.0}) CHECK(minimum_jerk_rate(end) == 0);
}
