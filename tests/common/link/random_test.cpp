#include <catch2/catch.hpp>

#include "common/base/random.hpp"

using namespace palpate;

TEST_CASE("splitmix64 gives the published sequence of seed 1234567") {
  std::uint64_t state = 1234567;
  CHECK(splitmix64(state) == 6457827717110365317ull);
  CHECK(splitmix64(state) == 3203168211198807973ull);
  CHECK(splitmix64(state) == 9817491932198370423ull);
}

TEST_CASE("xoshiro256** gives the published sequence of state 1, 2, 3, 4") {
  Random random(std::array<std::uint64_t, 4>{1, 2, 3, 4});
  CHECK(random.bits() == 11520u);
  CHECK(random.bits() == 0u);
  CHECK(random.bits() == 1509978240u);
  CHECK(random.bits() == 1215971899390074240ull);
}

TEST_CASE("uniform numbers are at least 0 and less than 1, with mean 1/2 and variance 1/12") {
  Random random(9);
  double sum = 0, squares = 0;
  constexpr int n = 200'000;
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    REQUIRE((u >= 0 && u < 1));
    sum += u;
    squares += u * u;
  }
  CHECK(sum / n == Approx(0.5).margin(0.003));
  CHECK(squares / n - sum * sum / n / n == Approx(1.0 / 12).margin(0.001));
}
