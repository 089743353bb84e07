// The polynomial forces of a nonlinear patch against the forces of the body itself.
#include "server/reduce/expansion.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/support/bending.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr int kVariables = 6;

Matrix random_shapes(const Dynamics& dynamics, std::uint64_t seed, double size_m) {
  Random random(seed);
  Matrix w(dynamics.masses().size(), kVariables);
  for (Eigen::Index c = 0; c < w.cols(); ++c)
    for (Eigen::Index r = 0; r < w.rows(); ++r) w(r, c) = random.uniform(-size_m, size_m);
  return w;
}

Vector random_variables(std::uint64_t seed) {
  Random random(seed);
  Vector y(kVariables);
  for (double& v : y) v = random.uniform(-1, 1);
  return y;
}

struct Case {
  LumpedBody body;
  Dynamics dynamics{body};
  BodyState state;
  Matrix shapes;

  explicit Case(LumpedBody b, double size_m = 0.002)
      : body(std::move(b)), state(random_state(dynamics, 3, 0.002, 0)), shapes(random_shapes(dynamics, 4, size_m)) {}

  Vector force(const Vector& y, const Vector& rate) const {
    Vector f;
    dynamics.forces(state.x + shapes * y, shapes * rate, f);
    return shapes.transpose() * f;
  }
  /// Force beyond the tangent.
  Vector beyond(const Vector& y) const {
    const Vector zero = Vector::Zero(kVariables);
    const Vector motion = shapes * y;
    Vector k_y, d_y;
    dynamics.multiply_tangents({0, state.x, Vector::Zero(state.x.size())}, motion, k_y, d_y);
    return force(y, zero) - force(zero, zero) + shapes.transpose() * k_y;
  }
  Matrix damping() const {
    Matrix d(kVariables, kVariables);
    for (Eigen::Index i = 0; i < kVariables; ++i) {
      Vector k_i, d_i;
      dynamics.multiply_tangents(state, shapes.col(i), k_i, d_i);
      d.col(i) = shapes.transpose() * d_i;
    }
    return d;
  }
  CubicTerms terms(int leading, double negligible = 0) const {
    const auto x = expand(dynamics, state, shapes, leading, negligible);
    REQUIRE(x);
    CubicTerms t;
    t.variables = kVariables;
    t.leading = leading;
    t.scale = Matrix::Identity(kVariables, kVariables);
    t.e3 = x->e3;
    t.e4 = x->e4;
    t.q = x->q;
    t.rate = Vector::Zero(kVariables);
    t.radius = 100;
    return t;
  }
};

Vector both_of(CubicForce terms, const Vector& y, const Vector& rate) {
  CubicForce::Variables elastic, damping;
  terms.move_to(y);
  terms.elastic(elastic);
  terms.damping(rate, {}, CubicForce::Variables::Zero(y.size()), damping);
  return elastic + damping;
}

Vector evaluate(const CubicTerms& terms, const Vector& y, const Vector& rate) { return both_of(CubicForce(terms), y, rate); }

/// Beside a patch with these dampers.
Vector evaluate(const CubicTerms& terms, const Vector& y, const Vector& rate, const Matrix& damping) {
  Patch patch;
  patch.contact = ContactKind::touch;
  patch.stiffness = Vector::Ones(damping.rows());
  patch.damping = damping;
  return both_of(CubicForce(terms, patch), y, rate);
}

LumpedBody stiffening_box() {
  LumpedBody body = box_body(3, 3, 3);
  body.law = SpringLaw::stiffening;
  body.stiffening = 30;
  return body;
}

}  // namespace

TEST_CASE("what the third order leaves of the forces shrinks with the fourth power of the displacement") {
  const Case c(GENERATE(box_body(3, 3, 3), stiffening_box()));
  const CubicTerms terms = c.terms(kVariables);
  const Vector y = random_variables(8), zero = Vector::Zero(kVariables);
  const auto left = [&](double s) { return (c.beyond(s * y) - evaluate(terms, s * y, zero)).norm(); };
  CHECK(left(1) < 0.1 * c.beyond(y).norm());
  CHECK(left(1) / left(0.5) == Approx(16).epsilon(0.2));
}

TEST_CASE("without a fourth-order energy what is left shrinks with the third power") {
  const Case c(box_body(3, 3, 3));
  CubicTerms terms = c.terms(kVariables);
  terms.e4.setZero();
  const Vector y = random_variables(8), zero = Vector::Zero(kVariables);
  const auto left = [&](double s) { return (c.beyond(s * y) - evaluate(terms, s * y, zero)).norm(); };
  CHECK(left(0.5) / left(0.25) == Approx(8).epsilon(0.2));
}

TEST_CASE("dampers turn with their elements to first order in the displacement") {
  const Case c(box_body(3, 3, 3));
  CubicTerms terms = c.terms(kVariables);
  terms.e3.setZero();
  terms.e4.setZero();
  const Vector y = random_variables(8), rate = 30 * random_variables(9), zero = Vector::Zero(kVariables);
  const auto damper = [&](double s) { return Vector(c.force(s * y, rate) - c.force(s * y, zero)); };
  constexpr double h = 1e-3;
  const Vector slope = (damper(h) - damper(-h)) / (2 * h);
  CHECK((evaluate(terms, h * y, rate, c.damping()) / h - slope).norm() < 1e-4 * slope.norm());
}

TEST_CASE("dampers that turn never push more than those of the patch brake, however far they turn") {
  const Case c(box_body(3, 3, 3));
  CubicTerms terms = c.terms(kVariables);
  terms.e3.setZero();
  terms.e4.setZero();
  const Matrix damping = c.damping();
  int pushed = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Vector y = random_variables(seed).normalized(), rate = 30 * random_variables(1000 + seed);
    for (const double far : {0.1, 1.0, 10.0, 100.0}) {
      const double power = evaluate(terms, far * y, rate, damping).dot(rate), braked = rate.dot(damping * rate);
      CHECK(std::abs(power) <= 0.5001 * braked);
      pushed += power > 0.25 * braked;
    }
  }
  CHECK(pushed > 10);  // or nothing was tried
}

TEST_CASE("dampers that the tangent has counted at the stamp are not counted twice") {
  // The symmetric tangent at a moving state holds the change of the dampers' directions at the state's own rate.
  Case c(box_body(3, 3, 3));
  const Vector rate = 30 * random_variables(9), zero = Vector::Zero(kVariables), y = random_variables(8);
  CubicTerms terms = c.terms(kVariables);
  terms.e3.setZero();
  terms.e4.setZero();
  terms.rate = rate;
  BodyState moving = c.state;
  moving.v = c.shapes * rate;
  Vector k_moving, k_still, d;
  c.dynamics.multiply_tangents(moving, c.shapes * y, k_moving, d);
  c.dynamics.multiply_tangents(c.state, c.shapes * y, k_still, d);
  const Vector counted = c.shapes.transpose() * (k_still - k_moving);
  constexpr double h = 1e-3;
  const auto damper = [&](double s) { return Vector(c.force(s * y, rate) - c.force(s * y, zero)); };
  const Vector slope = (damper(h) - damper(-h)) / (2 * h);
  CHECK((evaluate(terms, h * y, rate, c.damping()) / h + counted - slope).norm() < 1e-4 * slope.norm());
}

TEST_CASE("the leading variables alone carry the fourth order") {
  const Case c(box_body(3, 3, 3));
  const CubicTerms all = c.terms(kVariables), leading = c.terms(4);
  Vector y = random_variables(8);
  const Vector zero = Vector::Zero(kVariables);
  y.tail(2).setZero();
  const Vector difference = evaluate(all, y, zero) - evaluate(leading, y, zero);
  CHECK(difference.head(4).norm() < 1e-5 * evaluate(all, y, zero).norm());
}

TEST_CASE("elements that hardly move are left out without harm") {
  LumpedBody body = box_body(5, 5, 5);
  Case c(body);
  // Shapes that fall off from one corner.
  for (std::uint32_t i = 0; i < c.dynamics.nodes(); ++i)
    c.shapes.middleRows<3>(3 * static_cast<Eigen::Index>(i)) *= std::exp(-(body.nodes[i] - body.nodes[124]).norm() / 0.012);
  const auto all = expand(c.dynamics, c.state, c.shapes, kVariables, 0),
             most = expand(c.dynamics, c.state, c.shapes, kVariables, 1e-3);
  REQUIRE(all);
  REQUIRE(most);
  CHECK(most->elements < all->elements / 2);
  CHECK((all->e3 - most->e3).norm() < 1e-3 * all->e3.norm());
  CHECK((all->e4 - most->e4).norm() < 1e-3 * all->e4.norm());
}

TEST_CASE("where only so many elements are asked for, they are those that bend most, also where many bend alike") {
  constexpr std::size_t kMost = 60;
  constexpr double kBin = 17.0 / 16.0;  // weights that differ by less count as alike
  Case c(box_body(5, 5, 5));
  const auto chosen = [&](std::size_t most) { return elements_that_bend(c.dynamics, c.state, c.shapes, 0, most); };
  const auto bending = [&](const Element& e) {
    const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
    const double motion = (c.shapes.middleRows<3>(b) - c.shapes.middleRows<3>(a)).norm();
    return e.stiffness_n_m * std::pow(motion, 3) / (c.state.x.segment<3>(b) - c.state.x.segment<3>(a)).norm();
  };
  REQUIRE(chosen(c.body.elements.size()).size() == c.body.elements.size());
  const std::vector<std::uint32_t> most = chosen(kMost);
  CHECK(most.size() == kMost);
  double least_chosen = std::numeric_limits<double>::infinity(), most_left_out = 0;
  for (std::uint32_t e = 0; e < c.body.elements.size(); ++e) {
    const double weight = bending(c.body.elements[e]);
    if (std::find(most.begin(), most.end(), e) != most.end())
      least_chosen = std::min(least_chosen, weight);
    else
      most_left_out = std::max(most_left_out, weight);
  }
  CHECK(kBin * least_chosen > most_left_out);

  c.state.x = c.dynamics.rest_state().x;
  c.shapes = c.state.x.leftCols<1>();  // all as long again: springs of a kind bend alike
  CHECK(chosen(kMost).size() == kMost);
}

TEST_CASE("whatever terms say, a patch with them has energy left, and its force is that energy's gradient") {
  const Case c(box_body(3, 3, 3));
  CubicTerms terms = c.terms(kVariables);
  terms.q.resize(0, 0);
  terms.e3 *= 1000;
  Patch patch;
  patch.contact = ContactKind::touch;
  patch.stiffness = Vector::LinSpaced(kVariables, 1e-4, 3e-4);
  patch.damping = Matrix::Zero(kVariables, kVariables);
  CubicForce free(terms), held(terms, patch);
  int fell = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Vector u = random_variables(seed);
    const double linear = 0.5 * u.dot(patch.stiffness.cwiseProduct(u));
    CHECK(energy_at(held, u) >= -0.9001 * linear);
    if (energy_at(free, u) > -0.91 * linear) continue;
    ++fell;
    CubicForce::Variables force;
    held.move_to(u);
    held.elastic(force);
    CHECK((Vector(force) - 0.9 * patch.stiffness.cwiseProduct(u)).norm() < 1e-4 * force.norm());
  }
  CHECK(fell > 10);
}

TEST_CASE("a law without a Taylor series is refused") {
  LumpedBody body = box_body(3, 3, 3);
  body.law = SpringLaw::thigh_skin;
  const Case c(body);
  CHECK_FALSE(expand(c.dynamics, c.state, c.shapes, 4).has_value());
}

TEST_CASE("the elastic force of the terms is minus the gradient of their energy, inside and outside of the trusted radius") {
  const Case c(box_body(3, 3, 3));
  CubicTerms terms = c.terms(4);
  terms.q.resize(0, 0);
  terms.e2 = Eigen::VectorXf::Constant(pairs_of(kVariables), 1e-4F);
  terms.scale = 3 * Matrix::Identity(kVariables, kVariables) + 0.5 * Matrix::Ones(kVariables, kVariables);
  terms.radius = GENERATE(100.0, 1.0);
  CubicForce force(terms);
  const Vector u = random_variables(8), zero = Vector::Zero(kVariables);
  const Vector f = evaluate(terms, u, zero);
  for (Eigen::Index i = 0; i < kVariables; ++i) {
    constexpr double h = 0.01;
    const Vector e = Vector::Unit(kVariables, i);
    const auto slope = [&](double s) { return (energy_at(force, u + s * e) - energy_at(force, u - s * e)) / (2 * s); };
    CHECK(f[i] == Approx(-(4 * slope(h) - slope(2 * h)) / 3).margin(2e-3 * f.norm()));
  }
}

TEST_CASE("second-order forces are the second differences of the forces") {
  const Case c(GENERATE(box_body(3, 3, 3), stiffening_box(), solid_box(3, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01}),
                        solid_box(3, 3, 3, {SolidLaw::corotational, 8e3, 0.45, 0.01})));
  const std::vector<Vector> second = second_order_forces(c.dynamics, c.state, c.shapes);
  const Vector y = random_variables(8);
  Vector sum = Vector::Zero(c.state.x.size());
  for (int j = 0; j < kVariables; ++j)
    for (int i = 0; i <= j; ++i) sum += y[i] * y[j] * second[static_cast<std::size_t>(pair_at(i, j))];
  Vector at, plus, minus;
  constexpr double h = 0.02;
  const Vector still = Vector::Zero(c.state.x.size());
  c.dynamics.forces(c.state.x, still, at);
  c.dynamics.forces(c.state.x + h * c.shapes * y, still, plus);
  c.dynamics.forces(c.state.x - h * c.shapes * y, still, minus);
  const Vector difference = (plus + minus - 2 * at) / (2 * h * h);
  CHECK((sum - difference).norm() < 1e-3 * difference.norm());
}
