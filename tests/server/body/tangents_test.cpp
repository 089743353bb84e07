// K and D kept element by element against Dynamics' own products.
#include "server/body/tangents.hpp"

#include <catch2/catch.hpp>

#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

Matrix random_columns(Eigen::Index rows, Eigen::Index columns) {
  Random random(3);
  Matrix y(rows, columns);
  for (double& value : y.reshaped()) value = random.uniform(-1, 1);
  return y;
}

}  // namespace

TEST_CASE("Products of many columns with the tangents are those of one after the other, at the newest state") {
  const bool planar = GENERATE(false, true);
  LumpedBody body = box_body(4, 3, 3);
  body.planar = planar;
  std::swap(body.elements[7].a, body.elements[7].b);
  const Dynamics dynamics(body);
  Tangents tangents(dynamics);
  const Matrix y = random_columns(dynamics.masses().size(), 7);
  for (const std::uint64_t seed : {1, 2}) {
    const BodyState state = random_state(dynamics, seed, 0.003, 0.1);
    tangents.take(state);
    Matrix k_y, d_y;
    tangents.multiply(y, k_y, d_y);
    Matrix together;
    tangents.multiply_sum(y, 0.5, 17, together);
    CHECK((together - 0.5 * k_y - 17 * d_y).norm() < 1e-12 * together.norm());
    for (Eigen::Index c = 0; c < y.cols(); ++c) {
      Vector k, d;
      dynamics.multiply_tangents(state, y.col(c), k, d);
      CHECK((k_y.col(c) - k).norm() < 1e-13 * k.norm());
      CHECK((d_y.col(c) - d).norm() < 1e-13 * d.norm());
    }
  }
}

TEST_CASE("Products of many columns with the tangents of tetrahedra are those of the matrix that is put together") {
  const auto law = GENERATE(SolidLaw::corotational, SolidLaw::neo_hookean, SolidLaw::mooney_rivlin, SolidLaw::veronda_westmann,
                            SolidLaw::ogden);
  LumpedBody body = solid_box(4, 3, 3, {law, 4000, 0.4, 0.05, 0.8, {4, -3}, {{0.6, 0, 0.8}, 2, 1}});
  body.mass_damping_1_s = 2;
  const Dynamics dynamics(body);
  Tangents tangents(dynamics);
  const Matrix y = random_columns(dynamics.masses().size(), 7);
  for (const std::uint64_t seed : {1, 2}) {
    const BodyState state = random_state(dynamics, seed, 0.003, 0.1);
    tangents.take(state);
    Matrix k_y, d_y;
    tangents.multiply(y, k_y, d_y);
    Matrix together;
    tangents.multiply_sum(y, 0.5, 17, together);
    CHECK((together - 0.5 * k_y - 17 * d_y).norm() < 1e-12 * together.norm());
    BlockMatrix k = dynamics.make_matrix(), d = k;
    const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
    dynamics.assemble(state, 0, 0, 1, none, false, k);
    dynamics.assemble(state, 0, 1, 0, none, false, d);
    for (Eigen::Index c = 0; c < y.cols(); ++c) {
      Vector expected;
      k.multiply(y.col(c), expected);
      CHECK((k_y.col(c) - expected).norm() < 1e-12 * expected.norm());
      d.multiply(y.col(c), expected);
      CHECK((d_y.col(c) - expected).norm() < 1e-12 * expected.norm());
    }
  }
}

TEST_CASE("The upper half that springs put together themselves is that of the whole matrix") {
  LumpedBody body = box_body(5, 4, 4);
  body.elements.push_back(body.elements[7]);  // two between the same nodes
  bool clamp = false;
  SECTION("as they are") {}
  SECTION("compressed ones not softening it") { clamp = true; }
  SECTION("in a plane") { body.planar = true; }
  const Dynamics dynamics(body);
  const BodyState state = random_state(dynamics, 5, 0.004, 0.1);
  std::vector<std::uint8_t> held = body.fixed;
  held[17] = held[18] = held[60] = 1;
  BlockMatrix whole = dynamics.make_matrix();
  dynamics.assemble(state, 300, 20, 0.9, held, clamp, whole);
  UpperBlocks expected, found;
  expected.take(whole);
  Tangents tangents(dynamics);
  tangents.take(state);
  REQUIRE(tangents.can_assemble());
  tangents.assemble(300, 20, 0.9, held, clamp, found);
  REQUIRE(found.first.size() == expected.first.size());
  std::size_t at = 0;  // index into `found`, which omits pairs with a held node; they are zero here
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    CHECK((found.diagonal[i] - expected.diagonal[i]).norm() < 1e-12 * expected.diagonal[i].norm());
    for (std::uint32_t k = expected.first[i]; k < expected.first[i + 1]; ++k) {
      const UpperBlocks::Pair& pair = expected.pairs[k];
      const Eigen::Map<const Eigen::Matrix<float, 9, 1>> block(pair.block);
      if (held[i] || held[pair.column]) {
        CHECK(block.isZero(0));
        continue;
      }
      REQUIRE(found.pairs[at].column == pair.column);
      CHECK((Eigen::Map<const Eigen::Matrix<float, 9, 1>>(found.pairs[at++].block) - block).norm() <= 1e-6F * block.norm());
    }
    CHECK(found.first[i + 1] == at);
  }
}
