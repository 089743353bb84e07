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

TEST_CASE("A vector fades from its beginning to zero within its time, and its rate is that of differences") {
  const FadingVector fading{Micros{1'000'000}, Micros{400'000}, Vec3(0.3, -0.2, 0.1)};
  CHECK(fading.at(Micros{0}) == fading.from);
  CHECK(fading.at(Micros{1'200'000}).isApprox(0.5 * fading.from));
  CHECK(fading.at(Micros{1'400'000}).isZero(1e-15));
  CHECK(fading.over(Micros{1'400'000}));
  CHECK_FALSE(fading.over(Micros{1'399'999}));
  for (const int ms : {1050, 1200, 1390}) {
    constexpr Micros kStep{100};
    const Micros t{1000 * ms};
    const Vec3 difference = (fading.at(t + kStep) - fading.at(t - kStep)) / (2 * seconds(kStep));
    CHECK((fading.rate(t) - difference).norm() < 1e-6);
  }
}
