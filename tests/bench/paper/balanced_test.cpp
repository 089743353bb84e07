// The off-line bases of the scheme `balanced`.
#include "bench/paper/balanced_basis.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "bench/paper/balance.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct BalancedBlock {
  LumpedBody body;
  Dynamics dynamics{body};
  Skin skin{body};
  BodyState rest = dynamics.rest_state();
  BalancedBases bases{dynamics, skin, rest};
  explicit BalancedBlock(LumpedBody b) : body(std::move(b)) {}
};

double error_at(const SecondOrderSystem& y, const Matrix& basis, double omega) {
  const Complex s(0, omega);
  const ComplexMatrix whole = TransferFunction(y)(s);
  Matrix v = basis(y.coordinates, Eigen::all);
  const SecondOrderSystem small = project(y, v);
  return (TransferFunction(small)(s) - whole).norm() / whole.norm();
}

}  // namespace

TEST_CASE("A balanced basis is orthonormal in the masses, still where the body is held, and keeps the statics") {
  BalancedBlock block(box_body(4, 4, 4));
  const Matrix& v = block.bases.grasped(54);
  REQUIRE(v.cols() == BalancedBases::kColumns);
  CHECK((v.transpose() * block.dynamics.masses().asDiagonal() * v - Matrix::Identity(v.cols(), v.cols())).norm() < 1e-10);
  for (std::uint32_t i = 0; i < block.dynamics.nodes(); ++i)
    if (block.body.fixed[i] || i == 54) CHECK(v.middleRows<3>(3 * static_cast<Eigen::Index>(i)).norm() == 0);
  const SecondOrderSystem y = second_order_system(block.dynamics, block.rest, 54, {});
  CHECK(error_at(y, v.leftCols(3), 0) < 1e-9);
  // More of it is closer to the body.
  CHECK(error_at(y, v.leftCols(11), 60) < error_at(y, v.leftCols(5), 60));
  CHECK(error_at(y, v, 60) < 1e-3);
  CHECK(&block.bases.grasped(54) == &v);
}

TEST_CASE("The basis of a contact inside a triangle keeps the compliance of that very point") {
  BalancedBlock block(box_body(4, 4, 4));
  const SurfacePoint point{20, Vec3(0.2, 0.5, 0.3)};
  const Matrix v = block.bases.touched(point);
  Matrix b = Matrix::Zero(block.rest.x.size(), 3);
  for (const auto& [node, weight] : block.skin.weights(point))
    b.middleRows<3>(3 * static_cast<Eigen::Index>(node)) += weight * Mat3::Identity();
  const SecondOrderSystem y = pushed_system(block.dynamics, block.rest, b, {});
  CHECK(error_at(y, v.leftCols(3), 0) < 1e-9);
  CHECK(error_at(y, v.leftCols(8), 60) < 0.02);
}

TEST_CASE("A force between two vertices has the mean of their low-rank factors when they share the shifts") {
  BalancedBlock block(box_body(3, 3, 3));
  const auto pushed = [&](const NodeWeights& weights) {
    Matrix b = Matrix::Zero(block.rest.x.size(), 3);
    for (const auto& [node, weight] : weights) b.middleRows<3>(3 * static_cast<Eigen::Index>(node)) += weight * Mat3::Identity();
    return mass_scaled(pushed_system(block.dynamics, block.rest, b, {}));
  };
  ShiftMemory shifts;
  const Matrix first = low_rank_gramian(pushed({{25, 1.0}}), {}, &shifts).displacement;
  const Matrix second = low_rank_gramian(pushed({{26, 1.0}}), {}, &shifts).displacement;
  const LowRankGramian between = low_rank_gramian(pushed({{25, 0.25}, {26, 0.75}}), {}, &shifts);
  CHECK((between.displacement - 0.25 * first - 0.75 * second).norm() < 1e-12 * between.displacement.norm());
  CHECK(between.residual < 1e-9);
}

TEST_CASE("A body that is fixed nowhere gets a basis too") {
  LumpedBody loose = box_body(3, 3, 3);
  std::fill(loose.fixed.begin(), loose.fixed.end(), std::uint8_t{0});
  BalancedBlock block(std::move(loose));
  const Matrix touched = block.bases.touched({10, Vec3(1, 0, 0)}), grasped = block.bases.grasped(22);
  CHECK(touched.allFinite());
  CHECK(grasped.allFinite());
  CHECK(touched.cols() >= 8);
  CHECK(grasped.cols() >= 8);
}
