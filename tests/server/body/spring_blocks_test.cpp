// Springs in lanes of single precision against the one kernel, spring by spring in double.
#include "server/elements/spring_forces.hpp"

#include <catch2/catch.hpp>

#include "server/body/dynamics.hpp"
#include "tests/support/bodies.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

void add_all(const SpringBlocks& springs, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) {
  for (const auto& slabs : {springs.even_slabs(), springs.odd_slabs()})
    for (const SpringBlocks::Slab& slab : slabs) springs.add_forces(slab, u, v, f);
}

struct Bench {
  LumpedBody body;
  Dynamics dynamics{body};
  SpringBlocks springs{body};
  SpringForces forces{body};

  explicit Bench(LumpedBody b) : body(std::move(b)) {}
  /// Largest difference of a node's force, relative to the largest force.
  double worst(const BodyState& state) {
    const NodeArrays& f = forces.at(state.x, state.v);
    Vector expected;
    dynamics.forces(state.x, state.v, expected);
    double most = 0, off = 0;
    for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
      const Vec3 exact = at_node(expected, i) - body.masses_kg[i] * body.gravity_m_s2;
      most = std::max(most, exact.norm());
      off = std::max(off, (f.at(i) - exact).norm());
    }
    return off / most;
  }
};

}  // namespace

TEST_CASE("Springs side by side push as they do one by one") {
  LumpedBody body = box_body(7, 5, 6);
  SECTION("linear") {}
  SECTION("stiffening") {
    body.law = SpringLaw::stiffening;
    body.stiffening = 40;
  }
  SECTION("each its own stiffness, with a pull at rest, and some missing") {
    std::vector<Element> kept;
    for (std::size_t k = 0; k < body.elements.size(); ++k) {
      Element e = body.elements[k];
      e.stiffness_n_m *= 1 + 0.1 * static_cast<double>(k % 7);
      e.damping_n_s_m *= 1 + 0.2 * static_cast<double>(k % 5);
      if (k % 3 == 0) e.rest_length_m *= 0.98;
      if (k % 4 == 0) std::swap(e.a, e.b);
      if (k % 11 != 0) kept.push_back(e);
    }
    body.elements = kept;
  }
  SECTION("two between the same nodes") {
    const std::vector<Element> once = body.elements;
    body.elements.insert(body.elements.end(), once.begin(), once.begin() + 40);
  }
  Bench bench(std::move(body));
  CHECK(bench.worst(random_state(bench.dynamics, 3, 0.004, 0.1)) < 3e-6);
  CHECK(bench.worst(random_state(bench.dynamics, 4, 1e-6, 0)) < 3e-5);  // a micrometre in a body of 0.1 m
}

TEST_CASE("Springs side by side push to the same bits however wide the processor's vectors are") {
  LumpedBody body = box_body(7, 5, 6);
  body.law = SpringLaw::stiffening;
  body.stiffening = 40;
  const Bench bench(std::move(body));
  const SpringTables& tables = bench.springs.tables();
  NodeArrays u(bench.body.nodes.size()), v = u;
  const BodyState state = random_state(bench.dynamics, 3, 0.004, 0.1);
  for (std::uint32_t i = 0; i < bench.dynamics.nodes(); ++i) {
    u.set(i, at_node(state.x, i) - bench.body.nodes[i]);
    v.set(i, at_node(state.v, i));
  }
  NodeArrays expected(bench.body.nodes.size());
  const SpringBlocks::Slab all{0, tables.first.size() - 1};
  bench.springs.add_forces(all, u, v, expected);
  for (const auto& loops : spring_block_loops()) {
    NodeArrays f(bench.body.nodes.size());
    loops.run(tables, all.begin, all.end, u, v, f);
    CHECK(f.x == expected.x);
    CHECK(f.y == expected.y);
    CHECK(f.z == expected.z);
  }
}

TEST_CASE("A body squeezed into a point has forces that are numbers") {
  LumpedBody body = box_body(2, 2, 2);
  const SpringBlocks springs(body);
  NodeArrays u(8), v(8), f(8);
  for (std::uint32_t i = 0; i < 8; ++i) {
    u.set(i, -body.nodes[i]);  // all in one point
    v.set(i, Vec3(0.1 * i, 0, 0));
  }
  add_all(springs, u, v, f);
  for (std::uint32_t i = 0; i < 8; ++i) CHECK(f.at(i).allFinite());
}

TEST_CASE("The stiffest spring is the one with the largest strain") {
  LumpedBody body = box_body(3, 3, 3);
  body.law = SpringLaw::stiffening;
  body.stiffening = 12;
  const Bench bench(body);
  NodeArrays u(body.nodes.size());
  CHECK(bench.springs.stiffest(u) == Approx(1));
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) u.set(i, 0.1 * body.nodes[i]);  // everything stretched by 10 %
  CHECK(bench.springs.stiffest(u) == Approx(1 + 3 * 12 * 0.01).epsilon(1e-4));
}
