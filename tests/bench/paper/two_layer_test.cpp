// The two-layer local model: exact in one dimension, otherwise close to the body at both ends of the frequency range.
#include "bench/paper/two_layer.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>

#include "bench/paper/block_scaling.hpp"
#include "bench/paper/state_space.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kK = 60, kB = 0.24, kM = 1.0 / 216;

/// A straight row of nodes along x, the last one fixed.
LumpedBody row_body(int elements) {
  LumpedBody body;
  for (int i = 0; i <= elements; ++i) {
    body.nodes.push_back(kSpacingM * Vec3(i, 0, 0));
    body.masses_kg.push_back(kM);
    body.fixed.push_back(i == elements);
  }
  for (std::uint32_t i = 0; i + 1 < body.nodes.size(); ++i) body.elements.push_back({i, i + 1, kSpacingM, kK, kB});
  return body;
}

/// A sheet of n x n nodes, the sides and the bottom fixed.
LumpedBody sheet_body(int n) {
  LumpedBody body = box_body(n, n, 1);
  body.planar = true;
  body.triangles.clear();
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) body.fixed[static_cast<std::size_t>(i + n * j)] = i == 0 || i == n - 1 || j == 0;
  return body;
}

double dc_error(const LumpedBody& body, std::uint32_t port, const SecondOrderSystem& model) {
  const Dynamics dynamics(body);
  const SecondOrderSystem whole = second_order_system(dynamics, dynamics.rest_state(), port, body.fixed);
  const ComplexMatrix exact = TransferFunction(whole)(0);
  return (TransferFunction(model)(0) - exact).norm() / exact.norm();
}

}  // namespace

TEST_CASE("The two-layer model of a chain of four elements is eq. 12 of the paper", "[two-layer]") {
  const LumpedBody body = row_body(4);
  const Dynamics dynamics(body);
  const SecondOrderSystem system = two_layer_system(dynamics, dynamics.rest_state(), 0);
  REQUIRE(system.size() == 1);
  CHECK(system.coordinates == std::vector<std::uint32_t>{3});
  const TransferFunction transfer(system);
  for (double w = 0.1; w < 1e4; w *= 1.3) {
    const Complex s(0, w), z = kK + kB * s;
    const Complex eq12 = z * (1.0 - z / (2 * kM * s * s + 4.0 / 3 * z));
    CHECK(std::abs(transfer(s)(0, 0) - eq12) < 1e-12 * std::abs(eq12));
  }
}

TEST_CASE("A chain of any length keeps its static stiffness and its first element in the two-layer model", "[two-layer]") {
  for (const int elements : {2, 3, 7, 20}) {
    const LumpedBody body = row_body(elements);
    const Dynamics dynamics(body);
    const SecondOrderSystem system = two_layer_system(dynamics, dynamics.rest_state(), 0);
    const TransferFunction transfer(system);
    CHECK(transfer(0)(0, 0).real() == Approx(kK / elements).epsilon(1e-12));
    const Complex fast(0, 1e7);
    CHECK(std::abs(transfer(fast)(0, 0) / (kK + kB * fast)) == Approx(1).epsilon(1e-3));
  }
}

TEST_CASE("Outer elements that end one element away, and everything inside, are as they are in the body", "[two-layer]") {
  const LumpedBody body = sheet_body(5);
  const LocalBody local = TwoLayer(body).around({4 * 5 + 2}, body.fixed);
  REQUIRE(local.body.elements.size() < body.elements.size());
  int scaled = 0;
  for (const Element& e : local.body.elements) {
    CHECK(e.damping_n_s_m / e.stiffness_n_m == Approx(kB / kK).epsilon(1e-12));
    const auto cut = [&](std::uint32_t i) { return local.body.fixed[i] && !body.fixed[local.nodes[i]]; };
    if (cut(e.a) || cut(e.b)) {
      CHECK(e.stiffness_n_m < kK);
      ++scaled;
    } else {
      CHECK(e.stiffness_n_m == kK);
    }
  }
  CHECK(scaled == 3 + 2 + 2);  // from the three nodes below to the row below them, of which the middle three are free
}

TEST_CASE("Held at its sides, a body's static stiffness is met to a fifth of ring's error", "[two-layer]") {
  const LumpedBody body = sheet_body(13);
  const std::uint32_t port = 12 * 13 + 6;
  const Dynamics dynamics(body);
  std::vector<std::uint8_t> beyond(body.nodes.size(), 1);
  for (const std::uint32_t row : {11u, 12u})
    for (const std::uint32_t column : {5u, 6u, 7u}) beyond[row * 13 + column] = 0;
  const double ring = dc_error(body, port, second_order_system(dynamics, dynamics.rest_state(), port, beyond));
  const double two_layer = dc_error(body, port, two_layer_system(dynamics, dynamics.rest_state(), port));
  CHECK(two_layer < 0.1);
  CHECK(two_layer < 0.2 * ring);
}

TEST_CASE("A body that is held nowhere has a two-layer model without a static stiffness", "[two-layer]") {
  LumpedBody body = box_body(4, 4, 4);
  std::fill(body.fixed.begin(), body.fixed.end(), std::uint8_t{0});
  const Dynamics dynamics(body);
  SecondOrderSystem system = two_layer_system(dynamics, dynamics.rest_state(), 53);
  const Matrix k = Matrix(system.stiffness);
  const Matrix released = system.k_port - system.b_k.transpose() * k.completeOrthogonalDecomposition().solve(system.b_k);
  CHECK(released.norm() < 1e-9 * system.k_port.norm());
}

TEST_CASE("A block's compliance is that of springs in series in one dimension, and grows ever slower beyond", "[two-layer]") {
  const ShellCompliance row(1), plane(2), space(3);
  for (int m = 2; m < 30; ++m) {
    CHECK(row(m) == m);
    for (const ShellCompliance* w : {&plane, &space}) {
      CHECK((*w)(m) > (*w)(m - 1));
      CHECK((*w)(m + 1) - (*w)(m) < (*w)(m) - (*w)(m - 1));
    }
    CHECK(space(m) < plane(m));
  }
  CHECK(plane(1) == 1);
  CHECK(space(1) == 1);
}

TEST_CASE("Free sides that cut a shell make it as much more compliant as it lacks nodes", "[two-layer]") {
  const std::vector<int> half_plane{1, 5, 9, 13, 17, 21};
  CHECK(ShellCompliance(2, half_plane)(4) == Approx(ShellCompliance(2)(4)).epsilon(1e-14));
  // Layers that stop growing: shell j has 18 nodes where a half plane has 8 j + 6.
  const std::vector<int> strip{1, 9, 9, 9, 9, 9};
  double expected = 1;
  for (int j = 2; j <= 4; ++j) expected += shell_compliance(2, j) * (8 * j + 6) / 14.0;
  CHECK(ShellCompliance(2, strip)(4) == Approx(expected).epsilon(1e-14));
}

TEST_CASE("The dimension of a body is that of its elements' directions", "[two-layer]") {
  CHECK(dimension_of(row_body(3)) == 1);
  CHECK(dimension_of(sheet_body(4)) == 2);
  CHECK(dimension_of(box_body(3, 3, 3)) == 3);
}
