// What hourglass modes push beyond their tangents, against the difference of their own forces.
#include "server/reduce/hourglass_forces.hpp"

#include <catch2/catch.hpp>
#include <numeric>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// Of all elements at x, without the law's.
Vector hourglass_only(const Dynamics& dynamics, const Vector& x) {
  Vector f = Vector::Zero(x.size());
  for (std::uint32_t k = 0; k < dynamics.body().hexahedra.size(); ++k) {
    const HexaShape& shape = dynamics.hexahedra().shape(k);
    Hourglass none = shape.modes;
    none.c.setZero();
    none.k0 = 0;
    const TetraMaterial& m = dynamics.hexahedra().material(k);
    const Mat37 at = dynamics.hexahedra().gradient(k, x);
    const Mat37 p = elastic_stress(m, shape.modes, shape.rest, at) - elastic_stress(m, none, shape.rest, at);
    for (int i = 0; i < 8; ++i)
      at_node(f, dynamics.body().hexahedra[k].nodes[static_cast<std::size_t>(i)]) -= p * shape.rest.g.col(i);
  }
  return f;
}

}  // namespace

TEST_CASE("Hourglass forces beyond the tangent are what is left of those of a moved body without its linear change") {
  LumpedBody body = hexa_box(4, 3, 3, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01});
  Random random(3);
  for (Vec3& x : body.nodes) x += random_vector(random, 0.1 * kSpacingM);
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 4, 0.1 * kSpacingM, 0);
  Matrix moved(state.x.size(), 5);
  for (double& v : moved.reshaped()) v = random.uniform(-1, 1);
  Eigen::MatrixXf u(5, kSamples);
  for (float& v : u.reshaped()) v = static_cast<float>(random.uniform(-0.1, 0.1) * kSpacingM);
  std::vector<std::uint32_t> all(body.hexahedra.size());
  std::iota(all.begin(), all.end(), 0U);
  const Eigen::MatrixXf found = hourglass_forces(dynamics, state.x, all, moved, u);

  const Vector here = hourglass_only(dynamics, state.x);
  Matrix exact(5, kSamples);
  for (Eigen::Index s = 0; s < kSamples; ++s) {
    const Vector way = moved * u.col(s).cast<double>();
    constexpr double kStep = 1e-4;
    const Vector linear =
        (hourglass_only(dynamics, state.x + kStep * way) - hourglass_only(dynamics, state.x - kStep * way)) / (2 * kStep);
    exact.col(s) = moved.transpose() * (hourglass_only(dynamics, state.x + way) - here - linear);
  }
  REQUIRE(exact.norm() > 0);
  CHECK((found.cast<double>() - exact).norm() < 1e-4 * exact.norm());
}
