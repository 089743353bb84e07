// Springs of a body as the terms of a patch: forces that are the gradient of their energy, zero at the stamp, and no stiffer than
// a tick allows.
#include "common/patch/sampled_springs.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "common/base/types.hpp"
#include "common/patch/nonlinear_terms.hpp"
#include "tests/support/bending.hpp"
#include "tests/support/eigenvalues.hpp"
#include "tests/support/tangent_by_differences.hpp"

using namespace palpate;

namespace {

constexpr int kTool = 3, kModes = 5, kVariables = kTool + kModes, kCount = 11, kNodes = 7;
constexpr double kTickS = 1e-3;

struct Case {
  SampledElements springs;
  Eigen::VectorXd rate;
  std::mt19937 random{7};

  explicit Case(float stiffening, float stiffness = 40) {
    const auto some = [&](Eigen::Index rows, Eigen::Index cols) {
      return Eigen::MatrixXf(Eigen::MatrixXf::NullaryExpr(rows, cols, [&] { return draw(); }));
    };
    springs.stiffening = stiffening;
    if (stiffening > 0) springs.max_slope = SampledElements::steep_of(Eigen::ArrayXd::Constant(kCount, 10));
    springs.motion = rounded(some(3 * kNodes, kModes), 2);
    springs.position = 0.02F * some(3, kNodes);
    springs.nodes.resize(2, kCount);
    for (int e = 0; e < kCount; ++e) springs.nodes.col(e) << e % kNodes, (e + 1 + e / kNodes) % kNodes;
    springs.rest_length = 0.02F * Eigen::VectorXf::Ones(kCount);
    springs.stiffness = stiffness * (some(kCount, 1).array() + 1.5F).matrix();
    springs.damping = 0.01F * springs.stiffness;
    rate = 0.1 * some(kVariables, 1).cast<double>();
  }
  float draw() { return std::uniform_real_distribution<float>(-1, 1)(random); }
  SampledSpringForce compiled(bool slowed = false) const { return {springs, kTool, rate, kTickS, slowed}; }
  SampledSpringForce::Values displacement(float far) {
    SampledSpringForce::Values u(kVariables);
    for (float& v : u) v = far * draw();
    return u;
  }
};

/// dE/du by the definition, in double precision, one spring at a time.
Eigen::VectorXd expected(const SampledElements& s, const SampledSpringForce::Values& u) {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(kVariables);
  for (int e = 0; e < s.count(); ++e) {
    const Eigen::MatrixXd rows = s.motions(kTool).middleRows(3 * e, 3).cast<double>();
    const Vec3 d = s.spans().col(e).cast<double>(), delta = rows * u.cast<double>(), n = d.normalized();
    const double k = s.stiffness[e], c = s.stiffening, rest = s.rest_length[e];
    const auto tension = [&](double length) {
      const double strain = (length - rest) / rest;
      return k * rest * strain * (1 + c * strain * strain);
    };
    const double strain = (d.norm() - rest) / rest, slope = k * (1 + 3 * c * strain * strain),
                 across = tension(d.norm()) / d.norm();
    const Vec3 linear = (slope - across) * n * n.dot(delta) + across * delta;
    g += rows.transpose() * (tension((d + delta).norm()) * (d + delta).normalized() - tension(d.norm()) * n - linear);
  }
  return g;
}

}  // namespace

TEST_CASE("what sampled springs pull with beyond the linear patch is what each spring does") {
  for (const float stiffening : {0.0F, 30.0F}) {
    Case c(stiffening, 4);
    SampledSpringForce force = c.compiled();
    REQUIRE_FALSE(force.empty());
    for (int k = 0; k < 20; ++k) {
      const SampledSpringForce::Values u = c.displacement(0.01F);
      SampledSpringForce::Values g(kVariables);
      force.move_to(u);
      force.gradient(g);
      const Eigen::VectorXd exact = expected(c.springs, u);
      CHECK((g.cast<double>() - exact).norm() < 2e-5 * exact.norm() + 1e-6);
    }
  }
}

TEST_CASE("forces of sampled springs are the gradient of their energy, beyond the strain where their law goes on linearly too") {
  Case c(300, 400);
  SampledSpringForce force = c.compiled();
  REQUIRE_FALSE(force.empty());
  REQUIRE(force.linear_from() < 1);
  for (int k = 0; k < 20; ++k) {
    const SampledSpringForce::Values u = c.displacement(0.05F);
    SampledSpringForce::Values g(kVariables);
    force.move_to(u);
    force.gradient(g);
    for (int i = 0; i < kVariables; ++i) {
      constexpr float kStep = 1e-3F;
      const SampledSpringForce::Values step = kStep * SampledSpringForce::Values::Unit(kVariables, i);
      const double slope = (energy_at(force, u + step) - energy_at(force, u - step)) / (2.0 * static_cast<double>(kStep));
      CHECK(static_cast<double>(g[i]) == Approx(slope).epsilon(1e-2).margin(1e-2 * static_cast<double>(g.norm())));
    }
  }
}

TEST_CASE("at the stamp sampled springs pull, hold and brake with nothing") {
  Case c(30);
  SampledSpringForce force = c.compiled();
  SampledSpringForce::Values g(kVariables), change(kVariables), at_stamp(kVariables);
  const SampledSpringForce::Values zero = SampledSpringForce::Values::Zero(kVariables), rate = c.displacement(1);
  CHECK(std::abs(energy_at(force, zero)) < 1e-6);
  force.move_to(zero);
  force.gradient(g);
  CHECK(g.norm() < 1e-6F);
  force.damping(rate, change, at_stamp);
  CHECK(change.norm() < 1e-5F * rate.norm());
  CHECK(at_stamp.norm() == 0);
  // Zero slope as well: twice the displacement gives at least four times the force.
  const SampledSpringForce::Values u = c.displacement(1e-4F);
  SampledSpringForce::Values twice(kVariables);
  force.move_to(100 * u);
  force.gradient(g);
  force.move_to(200 * u);
  force.gradient(twice);
  CHECK(twice.norm() > 3 * g.norm());
}

TEST_CASE("dampers of sampled springs that have turned brake along their new axes") {
  Case c(0);
  SampledSpringForce force = c.compiled();
  const SampledSpringForce::Values u = c.displacement(0.02F), rate = c.displacement(1);
  SampledSpringForce::Values change(kVariables), at_stamp(kVariables);
  force.move_to(u);
  force.damping(rate, change, at_stamp);
  Eigen::VectorXd exact = Eigen::VectorXd::Zero(kVariables), stamp = exact;
  for (int e = 0; e < kCount; ++e) {
    const Eigen::MatrixXd rows = c.springs.motions(kTool).middleRows(3 * e, 3).cast<double>();
    const Vec3 d = c.springs.spans().col(e).cast<double>(), delta = rows * u.cast<double>(), w = rows * rate.cast<double>();
    const Vec3 n = d.normalized(), m = (d + delta).normalized();
    const double damper = c.springs.damping[e];
    exact += damper * rows.transpose() * (m * m.dot(w) - n * n.dot(w));
    stamp += damper * n.dot(rows * c.rate) / d.norm() * rows.transpose() * (delta - n * n.dot(delta));
  }
  CHECK((change.cast<double>() - exact).norm() < 1e-4 * exact.norm());
  CHECK((at_stamp.cast<double>() - stamp).norm() < 1e-4 * stamp.norm());
}

TEST_CASE("springs too stiff for a tick are not taken, and stiffening ends before they are") {
  CHECK(Case(0, 1e7F).compiled().empty());
  const Case soft(100, 40), firm(100, 4000);
  CHECK_FALSE(soft.compiled().empty());
  CHECK_FALSE(firm.compiled().empty());
  CHECK(firm.compiled().linear_from() < soft.compiled().linear_from());
}

TEST_CASE("springs whose ends meet pull with finite forces") {
  for (int k = 1; k <= 50; ++k) {
    Case c(k % 2 == 0 ? 30.0F : 0.0F);
    c.springs.motion = rounded(Eigen::MatrixXf::Identity(3 * kNodes, kModes), -1);
    c.springs.nodes.row(0).setConstant(1);
    c.springs.nodes.row(1).setZero();  // moves along each axis with one of the modes
    c.springs.position.col(1) = c.springs.position.col(0) + 0.001F * static_cast<float>(k) * Eigen::Vector3f(1, 0.3F, 0.07F);
    SampledSpringForce force = c.compiled(true);
    REQUIRE_FALSE(force.empty());
    SampledSpringForce::Values u = SampledSpringForce::Values::Zero(kVariables), g(kVariables);
    u.segment<3>(kTool) = c.springs.position.col(1) - c.springs.position.col(0);
    force.move_to(u);
    force.gradient(g);
    CHECK(g.allFinite());
    CHECK(std::isfinite(energy_at(force, u)));
  }
}

TEST_CASE("springs too stiff for a tick add mass enough for it, however they turn") {
  for (const double steepest : {1.0, 10.0, 100.0}) {
    const float stiffening = steepest > 1 ? 30 : 0;
    Case c(stiffening, 1e7F);
    if (stiffening > 0) c.springs.max_slope = SampledElements::steep_of(Eigen::ArrayXd::Constant(kCount, steepest));
    REQUIRE(c.compiled().empty());
    SampledSpringForce force = c.compiled(true);
    REQUIRE_FALSE(force.empty());
    const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(kModes, kModes) + force.added_mass();
    constexpr double kStable = 4 / (kTickS * kTickS);
    double bare = 0, slowed = 0;
    for (int k = 0; k < 200; ++k) {
      const Eigen::MatrixXd tangent =
          test::tangent_by_differences(force, c.displacement(0.001F * static_cast<float>(k)), kModes, 1e-3F);
      bare = std::max(bare, test::symmetric_eigenvalues(tangent).tail<1>()[0]);
      slowed = std::max(slowed, test::symmetric_eigenvalues(tangent, mass).tail<1>()[0]);
    }
    CAPTURE(steepest, bare, slowed);
    CHECK(bare > 10 * kStable);
    CHECK(slowed < 1.001 * kStable);
    CHECK(slowed > 0.1 * kStable);  // no excess mass
  }
  CHECK(Case(0, 40).compiled(true).added_mass().size() == 0);
}

TEST_CASE(
    "springs that stiffen keep to their law as steep as they are said to become, each, in a body too stiff for a tick too") {
  Case c(30, 1e6F);
  std::vector<SampledSpringForce::Values> displacements;
  for (int k = 0; k < 20; ++k) displacements.push_back(c.displacement(0.006F));
  Eigen::ArrayXd slopes = Eigen::ArrayXd::Ones(kCount);
  for (const SampledSpringForce::Values& u : displacements) {
    const Eigen::VectorXf delta = c.springs.motions(kTool) * u;
    for (int e = 0; e < kCount; ++e) {
      const double rest = c.springs.rest_length[e], length = (c.springs.spans().col(e) + delta.segment<3>(3 * e)).norm();
      slopes[e] = std::max(slopes[e], 1 + 3 * 30 * std::pow(length / rest - 1, 2));
    }
  }
  REQUIRE(slopes.maxCoeff() > 50);
  REQUIRE(slopes.maxCoeff() > 3 * slopes.minCoeff());
  const auto wrong = [&](const Eigen::ArrayXd& steepest) {
    c.springs.max_slope = SampledElements::steep_of(steepest);
    SampledSpringForce force = c.compiled(true);
    REQUIRE_FALSE(force.empty());
    REQUIRE(force.added_mass().size() > 0);
    double most = 0;
    for (const SampledSpringForce::Values& u : displacements) {
      SampledSpringForce::Values g(kVariables);
      force.move_to(u);
      force.gradient(g);
      const Eigen::VectorXd exact = expected(c.springs, u);
      most = std::max(most, (g.cast<double>() - exact).norm() / exact.norm());
    }
    return most;
  };
  CHECK(wrong(slopes) < 2e-5);
  CHECK(wrong(Eigen::ArrayXd::Constant(kCount, 10)) > 0.1);
}

TEST_CASE("far away sampled springs hold as all of them stretched do") {
  Case c(0);
  SampledSpringForce force = c.compiled();
  const Eigen::MatrixXd least = force.far_stiffness();
  for (int k = 0; k < 10; ++k) {
    const SampledSpringForce::Values way = c.displacement(1);
    constexpr float kFar = 1e3F;
    const Eigen::VectorXd w = way.cast<double>();
    CHECK(energy_at(force, kFar * way) / double{kFar * kFar} == Approx(0.5 * w.dot(least * w)).epsilon(1e-3));
  }
}

TEST_CASE("springs so squeezed that, let go of, they hold by more than the step takes are not taken at all") {
  const auto squeezed = [](float to) {
    Case c(0);
    c.springs.position *= to;
    return c;
  };
  REQUIRE_FALSE(squeezed(1).compiled(true).empty());
  const Case c = squeezed(1e-4F);
  const Eigen::MatrixXd g = c.springs.motions(kTool).cast<double>();
  Eigen::MatrixXd far = Eigen::MatrixXd::Zero(kVariables, kVariables);  // k - K_e, the limit far away from the stamp
  for (int e = 0; e < kCount; ++e) {
    const Vec3 d = c.springs.spans().col(e).cast<double>(), n = d.normalized();
    const double k = c.springs.stiffness[e], across = k * (1 - c.springs.rest_length[e] / d.norm());
    const Mat3 at_stamp = (k - across) * n * n.transpose() + across * Mat3::Identity();
    far += g.middleRows<3>(3 * e).transpose() * (k * Mat3::Identity() - at_stamp) * g.middleRows<3>(3 * e);
  }
  const auto modes = far.bottomRightCorner(kModes, kModes);
  REQUIRE(test::symmetric_eigenvalues(modes).tail<1>()[0] > 4 / (kTickS * kTickS));
  CHECK(c.compiled(true).empty());
}

TEST_CASE("an arch that snaps through under the hand gives all its energy away, as its springs do") {
  // Two springs over the halves of a span, with their common end pressed down to where it is still barely stable.
  constexpr double kHalf = 0.010, kHigh = 0.004, kPressed = 0.0025, kPull = 100;  // [m], [N/m]
  const double rest = std::hypot(kHalf, kHigh);
  const auto push = [&](double high) {
    const double length = std::hypot(kHalf, high);
    return -2 * kPull * (length - rest) * high / length;
  };
  const auto stored = [&](double high) { return kPull * std::pow(std::hypot(kHalf, high) - rest, 2); };
  NonlinearTerms terms;
  terms.variables = 1;
  terms.rate = Eigen::VectorXd::Zero(1);
  SampledElements& springs = terms.elements;
  Eigen::MatrixXf rows = Eigen::MatrixXf::Zero(9, 1);
  rows(5, 0) = 1;
  springs.motion = rounded(rows, -1);
  springs.position.setZero(3, 3);
  springs.position.col(0) = Vec3(-kHalf, 0, 0).cast<float>();
  springs.position.col(1) = Vec3(0, 0, kPressed).cast<float>();
  springs.position.col(2) = Vec3(kHalf, 0, 0).cast<float>();
  springs.nodes.resize(2, 2);
  springs.nodes << 0, 2, 1, 1;
  springs.rest_length.setConstant(2, static_cast<float>(rest));
  springs.stiffness.setConstant(2, static_cast<float>(kPull));
  springs.damping.setZero(2);
  constexpr double kStep = 1e-6;
  const double stiffness = -(push(kPressed + kStep) - push(kPressed - kStep)) / (2 * kStep);
  REQUIRE(stiffness > 0);
  Patch patch;
  patch.contact = ContactKind::touch;
  patch.stiffness = Eigen::VectorXd::Constant(1, stiffness);
  patch.damping = Eigen::MatrixXd::Zero(1, 1);
  NonlinearForce force(terms, patch);
  REQUIRE_FALSE(force.empty());
  bool fell = false;
  for (double high = kPressed; high > -1.2 * kHigh; high -= 1e-4) {
    const NonlinearForce::Variables u = NonlinearForce::Variables::Constant(1, high - kPressed);
    NonlinearForce::Variables residual;
    force.move_to(u);
    force.elastic(residual);
    CHECK(push(kPressed) - stiffness * u[0] + residual[0] == Approx(push(high)).margin(1e-4));
    const double linear = 0.5 * stiffness * u[0] * u[0];
    CHECK(energy_at(force, u) == Approx(stored(high) - stored(kPressed) + push(kPressed) * u[0] - linear).margin(1e-7));
    fell = fell || energy_at(force, u) < -linear;
  }
  CHECK(fell);
}
