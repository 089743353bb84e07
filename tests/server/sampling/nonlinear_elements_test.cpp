// Selection of nonlinear elements, and their second-order forces, against the forces of the body itself.
#include "server/sampling/nonlinear_elements.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

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

  explicit Case(LumpedBody b)
      : body(std::move(b)), state(random_state(dynamics, 3, 0.002, 0)), shapes(random_shapes(dynamics, 4, 0.002)) {}
};

LumpedBody stiffening_box() {
  LumpedBody body = box_body(3, 3, 3);
  body.law = SpringLaw::stiffening;
  body.stiffening = 30;
  return body;
}

}  // namespace

TEST_CASE("where only so many elements are asked for, they are those that bend most, also where many bend alike") {
  constexpr std::size_t kMost = 60;
  constexpr double kBin = 17.0 / 16.0;  // weights that differ by less count as equal
  Case c(box_body(5, 5, 5));
  const auto chosen = [&](std::size_t most) { return nonlinear_elements(c.dynamics, c.state, c.shapes, 0, most); };
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
  c.shapes = c.state.x.leftCols<1>();  // everything doubles in length: springs of one kind deform alike
  CHECK(chosen(kMost).size() == kMost);
}

TEST_CASE("second-order forces are the second differences of the forces") {
  const Case c(GENERATE(box_body(3, 3, 3), stiffening_box(), solid_box(3, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01}),
                        solid_box(3, 3, 3, {SolidLaw::corotational, 8e3, 0.45, 0.01}),
                        hexa_box(3, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01})));
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
