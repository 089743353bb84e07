// The computed H-infinity norm against closed forms and dense sampling.
#include "bench/paper/hinf.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/bench/paper/small_systems.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

StateSpace system(Matrix a, Matrix b, Matrix c, Matrix d0) {
  const Eigen::Index rows = d0.rows(), columns = d0.cols();
  return {std::move(a), std::move(b), std::move(c), std::move(d0), Matrix::Zero(rows, columns)};
}
StateSpace first_order(double gain, double pole, double feed = 0) {
  return system(Matrix::Constant(1, 1, -pole), Matrix::Constant(1, 1, gain), Matrix::Ones(1, 1), Matrix::Constant(1, 1, feed));
}
StateSpace second_order(double omega, double zeta) {
  Matrix a(2, 2), b(2, 1), c(1, 2);
  a << 0, 1, -omega * omega, -2 * zeta * omega;
  b << 0, 1;
  c << 1, 0;
  return system(a, b, c, Matrix::Zero(1, 1));
}

}  // namespace

TEST_CASE("A first-order system peaks at DC, or at infinity") {
  const PeakGain low = hinf_norm(first_order(6, 3));
  CHECK(low.norm == Approx(2));
  CHECK(low.omega_rad_s < 1e-6);
  // 1 - 2 / (s + 4): 1/2 at DC, 1 at infinity.
  const PeakGain high = hinf_norm(first_order(-2, 4, 1));
  CHECK(high.norm == Approx(1));
  CHECK(high.omega_rad_s > 1e3);
  CHECK(hinf_norm(system(Matrix(0, 0), Matrix(0, 2), Matrix(2, 0), 3 * Matrix::Identity(2, 2))).norm == Approx(3));
}

TEST_CASE("A resonance peaks at 1 / (2 zeta omega^2 sqrt(1 - zeta^2))") {
  for (const double zeta : {0.5, 0.1, 1e-2, 1e-4}) {
    const double omega = 40;
    const PeakGain peak = hinf_norm(second_order(omega, zeta));
    CHECK(peak.norm == Approx(1 / (2 * zeta * omega * omega * std::sqrt(1 - zeta * zeta))).epsilon(1e-7));
    CHECK(peak.omega_rad_s == Approx(omega * std::sqrt(1 - 2 * zeta * zeta)).epsilon(1e-3));
  }
}

TEST_CASE("The norm is what dense sampling approaches from below, with and without feed-through") {
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Index n = 3 + trial % 9, p = 1 + trial % 3;
    const auto draw = [&](Eigen::Index rows, Eigen::Index columns) {
      return Matrix::NullaryExpr(rows, columns, [&] { return random.uniform(-1, 1); }).eval();
    };
    Matrix a = draw(n, n);
    a.diagonal().array() -= a.eigenvalues().real().maxCoeff() + 0.02 + 0.1 * random.uniform(0, 1);
    const StateSpace y = system(a, draw(n, p), draw(p, n), (trial % 2) * draw(p, p));
    const PeakGain exact = hinf_norm(y), sampled = sampled_peak([&](Complex s) { return y.transfer(s); }, 1e-3, 1e3, 3000);
    CHECK(exact.norm >= sampled.norm * (1 - 1e-7));
    CHECK(exact.norm <= sampled.norm * (1 + 1e-5));
  }
}

TEST_CASE("The body's own norm agrees with sampling, and a difference from itself is nothing") {
  const SecondOrderSystem y = small_cube();
  const StateSpace z = proper(state_space(y));
  const PeakGain exact = hinf_norm(z);
  const PeakGain sampled = sampled_peak([&](Complex s) { return z.transfer(s); }, 1, 1e5, 400);
  CHECK(exact.norm == Approx(sampled.norm).epsilon(1e-6));
  CHECK(hinf_norm(difference(z, z)).norm < 1e-9 * exact.norm);
}

TEST_CASE("A difference is the difference of the transfer functions") {
  const StateSpace a = second_order(30, 0.2), b = first_order(2, 5, 0.5);
  const Complex s(1, 20);
  CHECK((difference(a, b).transfer(s) - (a.transfer(s) - b.transfer(s))).norm() < 1e-14);
}

TEST_CASE("A norm that does not exist is refused") {
  CHECK_THROWS_WITH(hinf_norm(first_order(1, -1)), Catch::Contains("left half-plane"));
  CHECK_THROWS_WITH(hinf_norm(state_space(small_cube())), Catch::Contains("infinite"));
}
