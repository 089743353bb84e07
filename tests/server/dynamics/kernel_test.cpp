// The element kernel against central finite differences of its own force, and the spring laws against their formulas.
#include "server/elements/spring_kernel.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "tests/support/bodies.hpp"

using namespace palpate;
using test::random_vector;

namespace {

constexpr double kStiffening = 4;

Vec3 force(SpringLaw law, const Element& e, const Vec3& d, const Vec3& w) {
  return SpringKernel::force_on_a(SpringKernel(law, kStiffening).evaluate(e, d, w));
}

/// Derivative of `f` at x by central differences.
template <class F>
Mat3 difference(const F& f, const Vec3& x, double step) {
  Mat3 j;
  for (int c = 0; c < 3; ++c) j.col(c) = (f(x + step * Vec3::Unit(c)) - f(x - step * Vec3::Unit(c))) / (2 * step);
  return j;
}

}  // namespace

TEST_CASE("Both tangents of an element are the derivatives of its force for every spring law") {
  const auto law = GENERATE(SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin);
  const SpringKernel kernel(law, kStiffening);
  Random random(7);
  for (int trial = 0; trial < 300; ++trial) {
    const Element e{0, 1, 0.05, random.uniform(10, 500), random.uniform(0, 2)};
    // From compressed to a fifth of the length to stretched to almost twice it: beyond the end of thigh_skin's curve.
    const Vec3 d = random.uniform(0.2, 1.9) * e.rest_length_m * random_vector(random, 1).normalized();
    const Vec3 w = random_vector(random, 0.5);
    const ElementState s = kernel.evaluate(e, d, w);
    const Mat3 k = SpringKernel::stiffness_exact(e, s), c = SpringKernel::damping(e, s);
    const Mat3 k_fd = difference([&](const Vec3& at) { return force(law, e, at, w); }, d, 2e-7);
    const Mat3 c_fd = difference([&](const Vec3& at) { return force(law, e, d, at); }, w, 1e-2);
    CHECK((k - k_fd).norm() < 1e-6 * k.norm());
    CHECK((c - c_fd).norm() <= 1e-6 * c.norm() + 1e-12);
  }
}

TEST_CASE("The energy of a spring is the integral of its tension for every law") {
  const auto law = GENERATE(SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin);
  const Element e{0, 1, 0.05, 60, 0};
  CHECK(spring_energy(law, kStiffening, e, 0) == 0);
  // Down to a tenth of a micrometre, and beyond the end of thigh_skin's curve.
  for (const double elongation_m : {1e-7, 2e-5, 4e-5, 0.003, 0.03, 0.04, -2e-5, -0.01, -0.04}) {
    constexpr int kPieces = 20000;
    double sum = 0;
    for (int k = 0; k < kPieces; ++k)
      sum += spring_response(law, kStiffening, e, (k + 0.5) / kPieces * elongation_m).tension * elongation_m / kPieces;
    CHECK(spring_energy(law, kStiffening, e, elongation_m) == Approx(sum).epsilon(1e-6));
  }
}

TEST_CASE("The symmetric stiffness is symmetric, is the exact one without motion, and is positive when clamped") {
  const auto law = GENERATE(SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin);
  const SpringKernel kernel(law, kStiffening);
  Random random(8);
  for (int trial = 0; trial < 100; ++trial) {
    const Element e{0, 1, 0.05, 60, 0.5};
    const Vec3 d = random.uniform(0.2, 1.9) * e.rest_length_m * random_vector(random, 1).normalized();
    const ElementState moving = kernel.evaluate(e, d, random_vector(random, 0.5)), still = kernel.evaluate(e, d, Vec3::Zero());
    const Mat3 k = SpringKernel::stiffness_symmetric(moving, false);
    CHECK((k - k.transpose()).norm() < 1e-15 * k.norm());
    CHECK((SpringKernel::stiffness_symmetric(still, false) - SpringKernel::stiffness_exact(e, still)).norm() < 1e-12 * k.norm());
    const Mat3 clamped = SpringKernel::stiffness_symmetric(moving, true);
    CHECK(Eigen::SelfAdjointEigenSolver<Mat3>(clamped).eigenvalues()[0] > -1e-9 * clamped.norm());
  }
}

TEST_CASE("The spring laws follow their formulas and start at the element's stiffness") {
  const Element e{0, 1, 0.05, 120, 0};
  CHECK(spring_response(SpringLaw::linear, 3, e, 0.01).tension == Approx(1.2));
  CHECK(spring_response(SpringLaw::stiffening, 3, e, 0.01).tension == Approx(1.2 * (1 + 3 * 0.04)));
  // f(x) = x / (5.4398 - 0.1418 x) with f'(0) = 1 / 5.4398 N/mm, scaled to 120 N/m at rest.
  CHECK(spring_response(SpringLaw::thigh_skin, 0, e, 0.010).tension == Approx(0.120 * 5.4398 * 10 / (5.4398 - 1.418)));
  for (const SpringLaw law : {SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin}) {
    CHECK(spring_response(law, 3, e, 0).slope == Approx(120));
    CHECK(spring_response(law, 3, e, -0.02).tension == Approx(-spring_response(law, 3, e, 0.02).tension));
    for (double x = 0.001; x < 0.08; x += 0.001)
      CHECK(spring_response(law, 3, e, x).tension > spring_response(law, 3, e, x - 0.001).tension);
  }
}

TEST_CASE("An element of no length has no force and no stiffness") {
  const Element e{0, 1, 0.05, 120, 1};
  const ElementState s = SpringKernel(SpringLaw::linear, 0).evaluate(e, Vec3::Zero(), Vec3::Ones());
  CHECK(SpringKernel::force_on_a(s).norm() == 0);
  CHECK(SpringKernel::stiffness_exact(e, s).allFinite());
}
