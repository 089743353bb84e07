// Input of the fit of few elements: forces scaled by the stiffness of each variable, and larger weight at the port.
#include "server/sampling/sampling.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <random>

using namespace palpate;

namespace {

constexpr Eigen::Index kSamplingVariables = 7;

/// Reshapes values to one column per sample, with one number per variable.
Eigen::MatrixXf by_variable(const Eigen::VectorXf& part) {
  return part.reshaped(part.size() / kSamplingVariables, kSamplingVariables).transpose();
}

}  // namespace

TEST_CASE("Forces at the port count several times as much in a fit, others as much as without a port") {
  std::mt19937 random(3);
  std::normal_distribution<float> draw;
  const auto some = [&](Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXf(Eigen::MatrixXf::NullaryExpr(rows, cols, [&] { return draw(random); }));
  };
  Sampling sampling;
  sampling.stiffness = some(kSamplingVariables, 1).cwiseAbs2().cast<double>().array() + 0.1;
  const Matrix u = some(kSamplingVariables, kSamples).cast<double>();
  const Eigen::MatrixXf all = some(kSamplingVariables, kSamples);
  constexpr Eigen::Index kElements = 5;
  ElementForces elements{std::vector<Rows>(3), std::vector<SampleMatrix>(3)};
  for (std::size_t axis = 0; axis < 3; ++axis)
    elements.motion[axis] = some(kElements, kSamplingVariables), elements.force[axis] = some(kElements, kSamples);
  const SampledResiduals without(all, u, sampling);
  const Eigen::MatrixXf parts = without.parts(elements);
  sampling.at_port = some(kSamplingVariables, 3).cast<double>();
  sampling.at_port.col(2) = sampling.at_port.col(0) - 2 * sampling.at_port.col(1);  // felt in two directions
  const SampledResiduals with(all, u, sampling);
  // In these units at_port^T f is (K^1/2 at_port)^T (K^-1/2 f).
  const Matrix directions = (sampling.stiffness.cwiseSqrt().asDiagonal() * sampling.at_port).leftCols<2>();
  const Eigen::MatrixXf projection =
      (directions * (directions.transpose() * directions).inverse() * directions.transpose()).cast<float>();
  const auto check = [&](const Eigen::VectorXf& has, const Eigen::VectorXf& had) {
    const Eigen::MatrixXf now = by_variable(has), before = by_variable(had);
    const float size = before.norm();
    CHECK((projection * now - kPortWeight * projection * before).norm() < 1e-4F * size);
    CHECK((now - projection * now - (before - projection * before)).norm() < 1e-4F * size);
    CHECK((projection * before).norm() > 0.1F * size);
  };
  check(with.all(), without.all());
  const Eigen::MatrixXf& now = with.parts(elements);
  for (Eigen::Index e = 0; e < kElements; ++e) check(now.col(e), parts.col(e));
}

TEST_CASE("Elements are fitted to the likeliest displacements by themselves, once and twice as far, there and back") {
  Sampling sampling;
  sampling.likely = Matrix::Identity(kSamplingVariables, kSamplingVariables);
  sampling.likeliest = {4, 2, 6, 1};
  const Matrix u = samples(sampling);
  REQUIRE(u.cols() == kSamples);
  const auto holds = [&](const Vector& x) { return (u.colwise() - x).colwise().norm().minCoeff() == 0; };
  for (Eigen::Index k = 0; k < kSamplingVariables; ++k)
    for (const double far : {-2.0, -1.0, 1.0, 2.0}) {
      CAPTURE(k, far);
      CHECK(holds(far * sampling.likely.col(k)) == (k == 4 || k == 2 || k == 6));
    }
}
