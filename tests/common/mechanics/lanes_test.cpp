// Logarithm and exponential in lanes against those of the standard library.
#include "common/mechanics/lanes.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace palpate;

namespace {

template <typename L>
void compare() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> of_log(-690, 690), near(-1e-3, 1e-3);
  for (int k = 0; k < 20'000; ++k) {
    L x, y, log_x, exp_y;
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      y[l] = k % 2 ? of_log(random) : near(random);
      x[l] = k % 2 ? std::exp(y[l]) : 1 + y[l];
    }
    lane_logs(x, log_x);
    lane_exps(y, exp_y);
    for (std::size_t l = 0; l < kLanes<L>; ++l) {
      CHECK(std::abs(log_x[l] - std::log(x[l])) <= 5e-16 * std::abs(std::log(x[l])));
      CHECK(std::abs(exp_y[l] - std::exp(y[l])) <= 5e-16 * std::exp(y[l]));
    }
  }
}

}  // namespace

TEST_CASE("logarithm and exponential of every lane are those of the library to rounding, near 1 and far from it") {
  compare<Lanes<double, 2>>();
  compare<Lanes<double, 8>>();
  Lanes<double, 4> one{1, 2, 0.5, 4}, log_one;
  lane_logs(one, log_one);
  CHECK(log_one[0] == 0);
  CHECK(log_one[1] == std::log(2.0));
}
