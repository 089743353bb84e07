// Directions selected by linear rollouts, against closed forms of oscillators: what they span, and that none is redundant.
#include "server/reduction/linear_rollouts.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace palpate;

namespace {

constexpr double kShift = 20, kTauS = 2 / kShift;
constexpr int kOscillators = 8;

/// Undamped oscillators, K = diag(omega^2).
Vector frequencies() {
  Vector omega(kOscillators);
  for (Eigen::Index i = 0; i < kOscillators; ++i) omega[i] = 4.0 + 7.0 * static_cast<double>(i);
  return omega;
}

Projection undamped() { return {frequencies().cwiseAbs2().asDiagonal(), Matrix::Zero(kOscillators, kOscillators)}; }

RolloutLoads no_loads() {
  return {Matrix::Zero(kOscillators, 3), Vector::Ones(3), Vector::Zero(kOscillators), Vector::Zero(kOscillators),
          Matrix(kOscillators, 0)};
}

/// Share of the energy that remains after projecting out Q, for q_i = b_i (1 - cos(omega_i t)) / omega_i^2, a constant push.
double left_out(const Matrix& q, const Vector& b) {
  const Vector omega = frequencies();
  const Vector energy = omega.cwiseAbs2() + Vector::Constant(kOscillators, kShift * kShift);
  double left = 0, all = 0;
  for (int step = 1; step <= 1000; ++step) {
    const double t = kTauS * step / 1000;
    Vector x(kOscillators);
    for (Eigen::Index i = 0; i < kOscillators; ++i) x[i] = b[i] * (1 - std::cos(omega[i] * t)) / (omega[i] * omega[i]);
    const Matrix at_q = q.transpose() * energy.asDiagonal() * q;
    const Vector projected = q * at_q.ldlt().solve(q.transpose() * energy.cwiseProduct(x));
    left += (x - projected).dot(energy.cwiseProduct(x - projected));
    all += x.dot(energy.cwiseProduct(x));
  }
  return left / all;
}

}  // namespace

TEST_CASE("A body that its loads move along one direction is followed in that direction") {
  RolloutLoads loads = no_loads();
  loads.velocity[3] = 0.2;
  loads.port(3, 2) = 1;
  const Matrix q = dominant_directions(undamped(), loads, kShift, 1);
  REQUIRE(q.cols() == 1);
  CHECK(std::abs(q(3, 0)) == Approx(1));
}

TEST_CASE("Directions are orthonormal, as many as candidates at most, and then all of them") {
  RolloutLoads loads = no_loads();
  loads.port = Matrix::Random(kOscillators, 3);
  loads.own = Vector::Random(kOscillators);
  const Matrix q = dominant_directions(undamped(), loads, kShift, kOscillators + 4);
  REQUIRE(q.cols() == kOscillators);
  CHECK((q.transpose() * q - Matrix::Identity(kOscillators, kOscillators)).norm() < 1e-9);
}

TEST_CASE("Of a push few directions leave next to nothing out, and less than as many softest oscillators do") {
  RolloutLoads loads = no_loads();
  loads.own = Vector::LinSpaced(kOscillators, 1, 2);
  double before = 1;
  for (int count = 1; count <= 3; ++count) {
    const double left = left_out(dominant_directions(undamped(), loads, kShift, count), loads.own);
    CHECK(left < 0.1 * before);
    CHECK(left < 0.1 * left_out(Matrix::Identity(kOscillators, count), loads.own));
    before = left;
  }
}

TEST_CASE("A direction along which the body would snap does not take all others' place") {
  Projection snapping = undamped();
  snapping.k(0, 0) = -90.0 * 90.0;  // would grow by e^9 within the rollout
  RolloutLoads loads = no_loads();
  loads.port(0, 0) = 1;
  loads.port(1, 1) = loads.port(2, 2) = 1;
  const Matrix q = dominant_directions(snapping, loads, kShift, 3);
  for (Eigen::Index i = 0; i < 3; ++i) CHECK(q.row(i).norm() == Approx(1).epsilon(1e-6));
}

TEST_CASE("Where the body is fixed at the port, and at rest, there are directions and they are finite") {
  const Matrix q = dominant_directions(undamped(), no_loads(), kShift, 2);
  CHECK(q.allFinite());
  CHECK(q.cols() == 2);
}
