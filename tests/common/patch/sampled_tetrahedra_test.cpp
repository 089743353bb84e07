// Tetrahedra of a solid as the terms of a patch: forces that are the gradient of their energy, zero at the stamp, bounded at any
// displacement, and no stiffer than a tick allows.
#include "common/patch/sampled_tetrahedra.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "common/base/types.hpp"
#include "common/patch/lagged_damping.hpp"
#include "tests/support/bending.hpp"
#include "tests/support/eigenvalues.hpp"
#include "tests/support/tangent_by_differences.hpp"

using namespace palpate;

namespace {

constexpr int kTetraTool = 3, kTetraModes = 5, kTetraVariables = kTetraTool + kTetraModes, kTetraCount = 11, kTetraNodes = 8;
constexpr double kTetraTickS = 1e-3, kSizeM = 0.02;

/// Corners of a cube, deformed and rotated since rest.
struct TetraCase {
  SampledElements solid;
  std::mt19937 random{7};

  explicit TetraCase(SolidLaw law = SolidLaw::neo_hookean, double young_pa = 2e4) {
    solid.law.kind = law;
    if (law == SolidLaw::ogden) solid.law = {law, 0.3, {5, -4}, {{0.6, 0, 0.8}, 2, 1}};
    const auto some = [&](Eigen::Index rows, Eigen::Index cols) {
      return Eigen::MatrixXf(Eigen::MatrixXf::NullaryExpr(rows, cols, [&] { return draw(); }));
    };
    solid.motion = rounded(some(3 * kTetraNodes, kTetraModes), 2);
    solid.rest.resize(3, kTetraNodes);
    for (int i = 0; i < kTetraNodes; ++i) solid.rest.col(i) = (kSizeM * Eigen::Vector3d(i & 1, i >> 1 & 1, i >> 2)).cast<float>();
    solid.rest += 0.1F * static_cast<float>(kSizeM) * some(3, kTetraNodes);
    solid.position = Eigen::AngleAxisf(0.5F, Eigen::Vector3f(1, 2, 3).normalized()).matrix() * solid.rest +
                     0.15F * static_cast<float>(kSizeM) * some(3, kTetraNodes);
    solid.nodes.resize(4, kTetraCount);
    for (int e = 0; e < kTetraCount; ++e) {  // any four nodes, with positive orientation
      int k = 0;
      float volume = 0;
      do {
        for (int i = 0; i < 4; ++i) solid.nodes(i, e) = static_cast<int>(random() % kTetraNodes);
        volume = 0;
        Eigen::Matrix3f edges;
        for (int i = 0; i < 3; ++i) edges.col(i) = solid.rest.col(solid.nodes(i + 1, e)) - solid.rest.col(solid.nodes(0, e));
        volume = edges.determinant();
        if (volume < 0) std::swap(solid.nodes(2, e), solid.nodes(3, e));
      } while (std::abs(volume) < 1e-6F && ++k < 1000);
    }
    const double volume = kSizeM * kSizeM * kSizeM / 6, nu = 0.4;
    const auto weights = (some(kTetraCount, 1).array() + 1.5F).eval();
    solid.stiffness = (static_cast<float>(volume * young_pa / (2 * (1 + nu))) * weights).matrix();
    solid.dilation = (static_cast<float>(volume * young_pa * nu / ((1 + nu) * (1 - 2 * nu))) * weights).matrix();
    solid.damping = 0.01F * weights.matrix();
  }
  float draw() { return std::uniform_real_distribution<float>(-1, 1)(random); }
  SampledSolidForce compiled(bool slowed = false, double step_s = kTetraTickS) const {
    return {solid, kTetraTool, step_s, slowed};
  }
  SampledSolidForce::Values displacement(float far) {
    SampledSolidForce::Values u(kTetraVariables);
    for (float& v : u) v = far * draw();
    return u;
  }
  struct OneTetra {
    Eigen::Matrix3d f, df;
    double mu, lambda, alpha;
  };
  /// Values of one tetrahedron for u, in double precision.
  OneTetra at(int e, const Eigen::VectorXd& u) const {
    Eigen::Matrix3d x, rest;
    for (int i = 0; i < 3; ++i) {
      x.col(i) = (solid.position.col(solid.nodes(i + 1, e)) - solid.position.col(solid.nodes(0, e))).cast<double>();
      rest.col(i) = (solid.rest.col(solid.nodes(i + 1, e)) - solid.rest.col(solid.nodes(0, e))).cast<double>();
    }
    const Eigen::VectorXd of_nodes = solid.motion.rows(kTetraTool).cast<double>() * u;
    Eigen::Matrix3d moved;
    for (int i = 0; i < 3; ++i)
      moved.col(i) = of_nodes.segment<3>(3 * solid.nodes(i + 1, e)) - of_nodes.segment<3>(3 * solid.nodes(0, e));
    const double shear = solid.stiffness[e], dilation = solid.dilation[e];
    const Eigen::Matrix3d f = x * rest.inverse(), df = moved * rest.inverse();
    if (solid.law.kind != SolidLaw::neo_hookean) return {f, df, shear, dilation, 0};
    const double mu = 4.0 / 3 * shear, lambda = dilation + 5.0 / 6 * shear;
    return {f, df, mu, lambda, 1 + 0.75 * mu / lambda};
  }
  /// 2/a (l^a - 1), continued along its tangent where x^(a/2 - 1), x = l^2, is cut off.
  static double ogden_power(double l, double a) {
    const double b = a / 2 - 1, x = l * l, low = b < 0 ? std::max(0.04, std::exp(4 / b)) : 0.04,
                 high = b > 0 ? std::exp(4 / b) : 1e6, edge = std::clamp(x, low, high), beyond = x - edge;
    return 2 / a * (std::pow(edge, a / 2) - 1) + std::pow(edge, b) * beyond * (1 + b / edge * beyond / 2);
  }
  double ogden_and_fibres(const Eigen::Matrix3d& f, double mu, double lambda) const {
    const Eigen::Vector3d l = Eigen::JacobiSVD<Eigen::Matrix3d>(f).singularValues();
    const double shares[] = {1 - solid.law.shape, solid.law.shape}, j = f.determinant() - 1;
    double sum = 0, volume = lambda;
    for (std::size_t p = 0; p < 2; ++p) {
      const double a = solid.law.exponents[p], mu_p = 2 * mu * shares[p] / a;
      sum -= mu_p * j;
      for (const double stretch : l) sum += mu_p / 2 * ogden_power(stretch, a);
      volume += mu_p;
    }
    const Eigen::Map<const Eigen::Vector3d> direction(solid.law.fibres.direction.data());
    const double e = (f * direction).squaredNorm() - 1, k = solid.law.fibres.share * mu, b = solid.law.fibres.exponent;
    return sum + 0.5 * volume * j * j + 0.5 * k * (e > 0 ? growth_integral(b * e * e) / b : e * e);
  }
  /// The energy beyond second order, by the law itself and its differences, without bounds.
  double expected_energy(const Eigen::VectorXd& u) const {
    double sum = 0;
    for (int e = 0; e < kTetraCount; ++e) {
      const OneTetra one = at(e, u);
      const auto psi = [&](double part) {
        const Eigen::Matrix3d f = one.f + part * one.df;
        if (solid.law.kind == SolidLaw::corotational) {
          const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
          REQUIRE(f.determinant() > 0);
          const Eigen::Matrix3d r = svd.matrixU() * svd.matrixV().transpose();
          const double c = r.cwiseProduct(f).sum() - 3;
          return one.mu * (f - r).squaredNorm() + 0.5 * one.lambda * c * c;
        }
        if (solid.law.kind == SolidLaw::ogden) return ogden_and_fibres(f, one.mu, one.lambda);
        const double i = f.squaredNorm(), j = f.determinant() - one.alpha;
        return 0.5 * one.mu * (i - 3 - std::log((i + 1) / 4)) + 0.5 * one.lambda * j * j;
      };
      constexpr double h = 1e-3;
      sum += psi(1) - psi(0) - (psi(h) - psi(-h)) / (2 * h) - 0.5 * (psi(h) + psi(-h) - 2 * psi(0)) / (h * h);
    }
    return sum;
  }
};

}  // namespace

TEST_CASE("the energy of sampled tetrahedra is that of their law beyond its second order") {
  TetraCase c(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden));
  SampledSolidForce force = c.compiled(true);
  REQUIRE_FALSE(force.empty());
  for (int k = 0; k < 20; ++k) {
    const SampledSolidForce::Values u = c.displacement(0.004F);
    const double exact = c.expected_energy(u.cast<double>());
    CHECK(energy_at(force, u) == Approx(exact).epsilon(2e-3).margin(1e-8));
  }
}

TEST_CASE("forces of sampled tetrahedra are the gradient of their energy, where elements are inside out or bent no further too") {
  TetraCase c(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden));
  SampledSolidForce force = c.compiled(true);
  REQUIRE_FALSE(force.empty());
  for (const float far : {0.004F, 0.02F, 0.1F})
    for (int k = 0; k < 20; ++k) {
      const SampledSolidForce::Values u = c.displacement(far);
      SampledSolidForce::Values g(kTetraVariables);
      force.move_to(u);
      force.gradient(g);
      for (int i = 0; i < kTetraVariables; ++i) {
        const float step_size = 0.01F * far;
        const SampledSolidForce::Values step = step_size * SampledSolidForce::Values::Unit(kTetraVariables, i);
        const double slope = (energy_at(force, u + step) - energy_at(force, u - step)) / (2.0 * static_cast<double>(step_size));
        CHECK(static_cast<double>(g[i]) == Approx(slope).epsilon(1e-2).margin(1e-2 * static_cast<double>(g.norm())));
      }
    }
}

TEST_CASE("at the stamp sampled tetrahedra pull, hold and brake with nothing") {
  TetraCase c(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden));
  SampledSolidForce force = c.compiled(true);
  SampledSolidForce::Values g(kTetraVariables), twice(kTetraVariables), change(kTetraVariables), at_stamp(kTetraVariables);
  const SampledSolidForce::Values zero = SampledSolidForce::Values::Zero(kTetraVariables), u = c.displacement(1e-4F);
  CHECK(std::abs(energy_at(force, zero)) < 1e-8);  // rounding of R times mu and lambda
  force.move_to(zero);
  force.gradient(g);
  CHECK(g.norm() < 1e-5F);
  force.damping(c.displacement(1), change, at_stamp);
  CHECK(change.norm() < 1e-6F);
  CHECK(at_stamp.norm() == 0);
  // Zero slope as well: twice the displacement gives four times the force.
  force.move_to(5 * u);
  force.gradient(g);
  force.move_to(10 * u);
  force.gradient(twice);
  CHECK(twice.norm() > 3.5F * g.norm());
}

TEST_CASE("dampers of sampled tetrahedra that have turned brake by Green's rate of strain there") {
  TetraCase c;
  SampledSolidForce force = c.compiled(true);
  const SampledSolidForce::Values u = c.displacement(0.004F), rate = c.displacement(1);
  SampledSolidForce::Values change(kTetraVariables), at_stamp(kTetraVariables);
  force.move_to(u);
  force.damping(rate, change, at_stamp);
  Eigen::VectorXd exact = Eigen::VectorXd::Zero(kTetraVariables);
  for (int e = 0; e < kTetraCount; ++e) {
    const TetraCase::OneTetra one = c.at(e, u.cast<double>());
    const Eigen::Matrix3d f_rate = c.at(e, rate.cast<double>()).df;
    const double t = c.solid.damping[e], mu = t * c.solid.stiffness[e], lambda = t * c.solid.dilation[e];
    const auto stress = [&](const Eigen::Matrix3d& f) -> Eigen::Matrix3d {
      const Eigen::Matrix3d product = f.transpose() * f_rate;
      return f * (mu * (product + product.transpose()) + lambda * product.trace() * Eigen::Matrix3d::Identity());
    };
    const Eigen::Matrix3d more = stress(one.f + one.df) - stress(one.f);
    for (int i = 0; i < kTetraVariables; ++i)
      exact[i] += more.cwiseProduct(c.at(e, Eigen::VectorXd::Unit(kTetraVariables, i)).df).sum();
  }
  CHECK((change.cast<double>() - exact).norm() < 1e-3 * exact.norm());
}

TEST_CASE("what dampers of sampled tetrahedra brake more is a matrix, once all of them have been asked") {
  TetraCase c(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden));
  SampledSolidForce force = c.compiled(true);
  const SampledSolidForce::Values u = c.displacement(0.004F), rate = c.displacement(1);
  SampledSolidForce::Values more(kTetraVariables), at_stamp(kTetraVariables);
  force.move_to(u);
  force.damping(rate, more, at_stamp);
  ModeMatrix closing = ModeMatrix::Constant(kTetraModes, kTetraModes, 1e-5);
  closing.diagonal().array() += 5e-4;
  const auto asked = [&](double damping) {
    LaggedDamping dampers(c.compiled(true), damping * ModeMatrix::Identity(kTetraModes, kTetraModes));
    REQUIRE_FALSE(dampers.empty());
    for (int group = 0; group < force.groups(); ++group) {
      dampers.renew(force, closing);
      CHECK(dampers.change().norm() == 0);
      CHECK(dampers.closing().size() == 0);
    }
    dampers.renew(force, closing);
    return dampers;
  };
  // With a patch that has enough damping, and with one that has none.
  const LaggedDamping all = asked(1e6), bare = asked(0);
  const Eigen::VectorXd of_all = all.change() * rate.cast<double>(), exact = more.cast<double>();
  CHECK((of_all - exact).norm() < 1e-4 * exact.norm());
  SampledSolidForce::Square there = SampledSolidForce::Square::Zero(kTetraVariables, kTetraVariables);
  for (int group = 0; group < force.groups(); ++group) force.add_dampers(group, there);
  CHECK((bare.change() - there.cast<double>()).norm() == 0);
  CHECK(test::symmetric_eigenvalues(bare.change())[0] > -1e-6 * bare.change().norm());
  const Eigen::MatrixXd inverse =
      Eigen::MatrixXd(closing).inverse() + Eigen::MatrixXd(all.change().bottomRightCorner(kTetraModes, kTetraModes));
  CHECK((all.closing() * inverse - Eigen::MatrixXd::Identity(kTetraModes, kTetraModes)).norm() < 1e-9);
}

TEST_CASE(
    "however far it goes, sampled tetrahedra push with no more than the linear patch soon outgrows, and with nothing that is not "
    "finite") {
  TetraCase c(GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden));
  SampledSolidForce force = c.compiled(true);
  const SampledSolidForce::Values way = c.displacement(1);
  SampledSolidForce::Values near(kTetraVariables), far(kTetraVariables);
  force.move_to(0.2F * way);
  force.gradient(near);
  force.move_to(20 * way);
  force.gradient(far);
  CHECK(far.allFinite());
  CHECK(far.norm() < 0.1F * near.norm());
  CHECK(std::abs(energy_at(force, 20 * way) - energy_at(force, 2000 * way)) < 0.1 * std::abs(energy_at(force, 20 * way)));
}

TEST_CASE("a solid too stiff for a step has as much mass as the step takes, and is not taken without") {
  const SolidLaw law = GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden);
  TetraCase soft(law, 100), stiff(law, 1e8);
  CHECK_FALSE(soft.compiled(false, 1e-4).empty());
  CHECK(soft.compiled(true, 1e-4).added_mass().size() == 0);
  CHECK(stiff.compiled().empty());
  const SampledSolidForce slowed = stiff.compiled(true);
  REQUIRE_FALSE(slowed.empty());
  const ModeMatrix& mass = slowed.added_mass();
  REQUIRE(mass.rows() == kTetraModes);
  CHECK(test::symmetric_eigenvalues(mass)[0] > 0);
}

TEST_CASE("a solid four times as stiff as a step takes has four times the mass where it is stiffest, and no tangent beyond it") {
  const SolidLaw law = GENERATE(SolidLaw::neo_hookean, SolidLaw::corotational, SolidLaw::ogden);
  double taken = 100, refused = 1e10;
  while (refused > 1.0001 * taken) {
    const double middle = std::sqrt(taken * refused);
    (TetraCase(law, middle).compiled().empty() ? refused : taken) = middle;
  }
  TetraCase c(law, 4 * taken);
  SampledSolidForce force = c.compiled(true);
  REQUIRE_FALSE(force.empty());
  REQUIRE(force.added_mass().rows() == kTetraModes);
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(kTetraModes, kTetraModes) + force.added_mass();
  CHECK(test::symmetric_eigenvalues(mass).tail<1>()[0] == Approx(4).epsilon(1e-3));
  double slowed = 0;  // stiffness of unit mass
  for (int k = 0; k < 200; ++k) {
    const Eigen::MatrixXd tangent = test::tangent_by_differences(force, c.displacement(0.002F), kTetraModes, 1e-4F);
    slowed = std::max(slowed, test::symmetric_eigenvalues(tangent, mass).tail<1>()[0]);
  }
  CAPTURE(law, slowed);
  if (law != SolidLaw::ogden) CHECK(slowed < 4 / (kTetraTickS * kTetraTickS));  // its fibres stiffen beyond any bound
}
