// Springs side by side against central differences of their own force, and against themselves at every width of this processor.
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <numeric>

#include "server/elements/element_loops.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/eigenvalues.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

SpringMaterial any_law() { return {GENERATE(SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin), 4, false}; }

/// One spring from the origin to d, whose end moves at w.
struct OneSpring {
  SpringMaterial material;
  Element element;

  ElementGroup<TrussShape> group() const {
    const TrussShape shape(element);
    const std::vector<const TrussShape*> all(kElementLanes, &shape);
    ElementGroup<TrussShape> one;
    one.numbers = ShapeNumbers<TrussShape>::of(all);
    one.nodes[0].fill(0);
    one.nodes[1].fill(1);
    one.count = 1;
    return one;
  }
  static Vector ends(const Vec3& of_b) { return (Vector(6) << Vec3::Zero(), of_b).finished(); }
  Vec3 force_on_a(const Vec3& d, const Vec3& w) const {
    const Vector x = ends(d), v = ends(w);
    Vector f = Vector::Zero(6);
    element_loops<TrussShape>().back().add_forces(material, group(), x.data(), v.data(), f.data());
    CHECK(f.head<3>() == -f.tail<3>());
    return f.head<3>();
  }
  /// Returns c_d D_aa + c_k K_aa.
  Mat3 block(const Vec3& d, const Vec3& w, double c_d, double c_k, bool clamp) const {
    const Vector x = ends(d), v = ends(w);
    ElementBlocks<TrussShape> blocks;
    element_loops<TrussShape>().back().blocks(material, group(), x.data(), v.data(), c_d, c_k, clamp, blocks);
    Mat3 k;
    for (int n = 0; n < 9; ++n) {
      const auto at = [&](std::size_t i, std::size_t j) {
        return blocks.at[pair_index(i, j)][static_cast<std::size_t>(n)].of[0];
      };
      k(n / 3, n % 3) = at(0, 0);
      CHECK(at(1, 1) == at(0, 0));
      CHECK(at(1, 0) == -at(0, 0));
    }
    return k;
  }
};

/// Derivative of `f` at x by central differences.
template <class F>
Mat3 difference(const F& f, const Vec3& x, double step) {
  Mat3 j;
  for (int c = 0; c < 3; ++c) j.col(c) = (f(x + step * Vec3::Unit(c)) - f(x - step * Vec3::Unit(c))) / (2 * step);
  return j;
}

}  // namespace

TEST_CASE("A spring's blocks are the derivatives of its force, but for the rotation of its damper", "[elements]") {
  const SpringMaterial law = any_law();
  Random random(7);
  for (int trial = 0; trial < 100; ++trial) {
    const OneSpring one{law, {0, 1, 0.05, random.uniform(10, 500), random.uniform(0, 2)}};
    // From compressed to a fifth of the length to stretched to almost twice it: beyond the end of thigh_skin's curve.
    const Vec3 d = random.uniform(0.2, 1.9) * one.element.rest_length_m * random_vector(random, 1).normalized();
    const Vec3 w = random_vector(random, 0.5), n = d.normalized();
    const Mat3 rotation = one.element.damping_n_s_m / d.norm() * n * (w - n * n.dot(w)).transpose();
    const Mat3 k = one.block(d, w, 0, 1, false), c = one.block(d, w, 1, 0, false);
    const Mat3 k_fd = difference([&](const Vec3& at) { return one.force_on_a(at, w); }, d, 2e-7);
    const Mat3 c_fd = difference([&](const Vec3& at) { return one.force_on_a(d, at); }, w, 1e-2);
    CHECK((k + rotation - k_fd).norm() < 1e-6 * k.norm());
    CHECK((c - c_fd).norm() <= 1e-6 * c.norm() + 1e-12);
    CHECK((k - k.transpose()).norm() < 1e-15 * k.norm());
    const Mat3 clamped = one.block(d, w, 0, 1, true);
    CHECK(test::symmetric_eigenvalues(clamped)[0] > -1e-9 * clamped.norm());
    CHECK(test::symmetric_eigenvalues(clamped - k)[0] > -1e-9 * clamped.norm());
    CHECK((one.block(d, w, 0.3, 0.7, false) - 0.3 * c - 0.7 * k).norm() < 1e-14 * k.norm());
  }
}

TEST_CASE("A spring's force is minus the gradient of its energy", "[elements]") {
  const SpringMaterial law = any_law();
  const OneSpring one{law, {0, 1, 0.05, 120, 0}};
  Random random(8);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 d = random.uniform(0.2, 1.9) * one.element.rest_length_m * random_vector(random, 1).normalized();
    const Vec3 direction = random_vector(random, 1);
    const auto energy = [&](double by) { return law.energy(120, 0.05, (d + by * direction).norm() - 0.05); };
    CHECK(one.force_on_a(d, Vec3::Zero()).dot(direction) == Approx((energy(1e-7) - energy(-1e-7)) / 2e-7).epsilon(1e-6));
  }
}

TEST_CASE("A spring of no length has no force and no stiffness", "[elements]") {
  const OneSpring one{any_law(), {0, 1, 0.05, 120, 1}};
  CHECK(one.force_on_a(Vec3::Zero(), Vec3::Ones()).norm() == 0);
  CHECK(one.block(Vec3::Zero(), Vec3::Ones(), 1, 1, false).norm() == 0);
}

TEST_CASE("Springs in a plane have no stiffness across it", "[elements]") {
  const OneSpring one{{SpringLaw::linear, 0, true}, {0, 1, 0.05, 120, 1}};
  const Mat3 k = one.block({0.03, 0.05, 0}, {0.1, 0, 0}, 1, 1, false);
  CHECK(k.row(2).norm() + k.col(2).norm() == 0);
  CHECK(k.topLeftCorner<2, 2>().determinant() > 0);
}

TEST_CASE("Springs have the same bits at every width, and products with their tangents are those of their blocks", "[elements]") {
  LumpedBody body = box_body(4, 3, 5);
  body.law = GENERATE(SpringLaw::linear, SpringLaw::stiffening, SpringLaw::thigh_skin);
  body.stiffening = 30;
  body.elements[3].rest_length_m *= 1.3;
  body.elements[5].stiffness_n_m *= 7;
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 4, 0.004, 0.5);
  const SpringMaterial law(body);
  std::vector<std::uint32_t> all(body.elements.size());
  std::iota(all.begin(), all.end(), 0U);
  const auto batches = dynamics.springs().batches(all);
  REQUIRE(all.size() % kElementLanes != 0);
  Vector one_by_one = Vector::Zero(state.x.size());
  for (const Element& e : body.elements) {
    const OneSpring one{law, e};
    const Vec3 f = one.force_on_a(at_node(state.x, e.b) - at_node(state.x, e.a), at_node(state.v, e.b) - at_node(state.v, e.a));
    at_node(one_by_one, e.a) += f;
    at_node(one_by_one, e.b) -= f;
  }
  const auto loops = element_loops<TrussShape>();
  for (const auto& variant : loops) {
    INFO(variant.width << " in a vector");
    Vector f = Vector::Zero(state.x.size());
    for (const auto& batch : batches) {
      variant.add_forces(law, batch.group, state.x.data(), state.v.data(), f.data());
      ElementBlocks<TrussShape> blocks, expected;
      variant.blocks(law, batch.group, state.x.data(), state.v.data(), 0.3, 0.7, true, blocks);
      loops.front().blocks(law, batch.group, state.x.data(), state.v.data(), 0.3, 0.7, true, expected);
      for (std::size_t p = 0; p < blocks.at.size(); ++p)
        for (std::size_t n = 0; n < 9; ++n)
          for (std::size_t l = 0; l < batch.group.count; ++l) REQUIRE(blocks.at[p][n].of[l] == expected.at[p][n].of[l]);
    }
    CHECK(f == one_by_one);
  }
  BlockMatrix k = dynamics.make_matrix(), d = k;
  k.set_zero(), d.set_zero();
  const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
  dynamics.springs().add_tangents(state, 0, 1, none, false, k);
  dynamics.springs().add_tangents(state, 1, 0, none, false, d);
  Random random(5);
  Vector y(state.x.size()), k_y, d_y, expected;
  for (double& value : y) value = random.uniform(-1, 1);
  dynamics.multiply_tangents(state, y, k_y, d_y);
  k.multiply(y, expected);
  CHECK((k_y - expected).norm() < 1e-13 * expected.norm());
  d.multiply(y, expected);
  CHECK((d_y - expected).norm() < 1e-13 * expected.norm());
}
