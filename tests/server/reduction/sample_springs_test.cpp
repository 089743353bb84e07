// A few springs that represent all: against the body's own forces at displacements that were not among the samples.
#include "server/reduction/sample_elements.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "server/sampling/sparse_nnls.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

struct OneCost : ColumnCosts {
  void with(const std::vector<Eigen::Index>& /*there*/) override {}
  float of(Eigen::Index /*column*/) const override { return 1; }
};

/// Columns in pairs: the second of a pair is cheap, its first and single columns are not; no room for more than `most`.
struct PairCost : ColumnCosts {
  explicit PairCost(std::size_t room) : most(room) {}
  void with(const std::vector<Eigen::Index>& columns) override { there = columns; }
  float of(Eigen::Index column) const override {
    if (there.size() >= most) return std::numeric_limits<float>::infinity();
    return std::find(there.begin(), there.end(), column ^ 1) == there.end() ? 9.0F : 1.0F;
  }
  std::size_t most;
  std::vector<Eigen::Index> there;
};

}  // namespace

TEST_CASE("sparse weights find the few columns that a sum was made of, and none is negative") {
  std::mt19937 random(3);
  std::normal_distribution<float> draw;
  const Eigen::MatrixXf a = Eigen::MatrixXf::NullaryExpr(60, 40, [&] { return draw(random); });
  const Eigen::VectorXf t = 2 * a.col(7) + 0.5F * a.col(21) + 3 * a.col(33);
  OneCost one;
  const SparseSolution found = sparse_nnls(a, t, 10, 1e-4F, one);
  CHECK(found.left <= 2e-3F);  // a small ridge regularises the weights
  CHECK(found.weights.minCoeff() > 0);
  Eigen::VectorXf w = Eigen::VectorXf::Zero(40);
  for (std::size_t k = 0; k < found.columns.size(); ++k) w[found.columns[k]] = found.weights[static_cast<Eigen::Index>(k)];
  CHECK(w[7] == Approx(2).epsilon(1e-3));
  CHECK(w[21] == Approx(0.5).epsilon(1e-2));
  CHECK(w[33] == Approx(3).epsilon(1e-3));
  // A part that only a negative weight could provide remains.
  const SparseSolution none = sparse_nnls(a.leftCols(1), -a.col(0), 10, 1e-4F, one);
  CHECK(none.columns.empty());
}

TEST_CASE("sparse weights prefer columns that cost little for what they bring, and stop where there is no room") {
  // Orthogonal columns: each contributes its own part of t.
  const Eigen::MatrixXf a = Eigen::MatrixXf::Identity(6, 6);
  const Eigen::VectorXf t = (Eigen::VectorXf(6) << 1, 0.5F, 0.9F, 0.2F, 0.8F, 0.1F).finished();
  PairCost costs(3);
  const SparseSolution found = sparse_nnls(a, t, 6, 1e-4F, costs);
  // After the first column its partner, half as large at a ninth of the cost, comes before 0.9; then 0.9 before 0.8.
  CHECK(found.columns == std::vector<Eigen::Index>{0, 1, 2});
}

TEST_CASE("positive weights are those of least squares without the columns that would not be positive") {
  std::mt19937 random(4);
  std::normal_distribution<float> draw;
  const Eigen::MatrixXf a = Eigen::MatrixXf::NullaryExpr(80, 12, [&] { return draw(random); });
  Eigen::VectorXf w = Eigen::VectorXf::LinSpaced(12, 0.5F, 3);
  const SparseSolution all = positive_weights(a, a * w);
  CHECK(all.columns.size() == 12);
  CHECK((all.weights - w).norm() < 1e-3F * w.norm());
  CHECK(all.left < 1e-3F);
  w[3] = w[8] = -1;
  const SparseSolution some = positive_weights(a, a * w);
  CHECK(some.columns.size() <= 10);
  CHECK(some.weights.minCoeff() > 0);
  const Eigen::MatrixXf rest = a(Eigen::all, some.columns);
  CHECK((rest.transpose() * (rest * some.weights - a * w)).norm() < 1e-2F * (rest.transpose() * (a * w)).norm());
}

TEST_CASE("A tenth of the springs of a block bends as all of them do where it was not sampled, within a few hundredths") {
  for (const SpringLaw law : {SpringLaw::linear, SpringLaw::stiffening}) {
    LumpedBody body = box_body(6, 6, 5);
    body.law = law;
    body.stiffening = law == SpringLaw::stiffening ? 30 : 0;
    const Dynamics dynamics(body);
    const BodyState state = random_state(dynamics, 5, 0.0005, 0);
    const WholeBody whole(dynamics, state);
    // Smooth shapes: an indentation of the top, sheared and twisted.
    constexpr Eigen::Index kVariables = 6;
    Sampling sampling;
    sampling.budget = {kVariables, false, false, 3, law == SpringLaw::stiffening};
    Matrix moved = Matrix::Zero(state.x.size(), kVariables);
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      const Vec3& x = body.nodes[i];
      const double far = (x - body.nodes.back()).norm(), indentation = std::exp(-far * far / (0.04 * 0.04)), up = x.z() / 0.1;
      auto rows = moved.middleRows<3>(3 * static_cast<Eigen::Index>(i));
      rows.col(0) = indentation * Vec3::UnitX();
      rows.col(1) = indentation * Vec3::UnitY();
      rows.col(2) = indentation * Vec3::UnitZ();
      rows.col(3) = up * Vec3::UnitX();
      rows.col(4) = up * up * Vec3::UnitY();
      rows.col(5) = up * Vec3(-x.y(), x.x(), 0) / 0.1;
    }
    for (Eigen::Index k = 0; k < kVariables; ++k) {
      Vector column = moved.col(k);
      mask(body.fixed, column);
      moved.col(k) = column;
    }
    Matrix k_moved, d_moved;
    whole.multiply(moved, k_moved, d_moved);
    const Matrix stiffness = moved.transpose() * k_moved;
    sampling.stiffness = stiffness.diagonal();
    sampling.likely = 0.004 * Matrix::Identity(kVariables, kVariables);
    sampling.likeliest = {0, 1, 2};
    const auto springs = sample_elements(whole, moved, sampling);
    REQUIRE(springs);
    CHECK(10 * springs->count() <= static_cast<int>(body.elements.size()));
    CHECK(numbers_of(sampling.budget, springs->motion.nodes(), springs->count()) <= kUsualNumbers);
    CHECK(springs->stiffness.minCoeff() > 0);
    CHECK(springs->max_slope.size() == (law == SpringLaw::stiffening ? static_cast<std::size_t>(springs->count()) : 0));
    SampledSpringForce force(*springs, 0, Vector::Zero(kVariables), 1e-5, false);
    REQUIRE_FALSE(force.empty());
    std::mt19937 random(11);
    std::uniform_real_distribution<double> draw(-0.005, 0.005);
    Vector still = Vector::Zero(state.x.size()), here, there;
    dynamics.forces(state.x, still, here);
    double wrong = 0, all = 0;
    for (int k = 0; k < 50; ++k) {
      const Vector u = Vector::NullaryExpr(kVariables, [&] { return draw(random); });
      dynamics.forces(state.x + moved * u, still, there);
      const Vector exact = -(moved.transpose() * (there - here) + stiffness * u);
      SampledSpringForce::Values g(kVariables);
      force.move_to(u.cast<float>());
      force.gradient(g);
      const Vector unit = sampling.stiffness.cwiseSqrt().cwiseInverse();
      wrong += unit.cwiseProduct(g.cast<double>() - exact).squaredNorm();
      all += unit.cwiseProduct(exact).squaredNorm();
    }
    CAPTURE(static_cast<int>(law));
    CHECK(std::sqrt(wrong / all) < 0.03);
  }
}
