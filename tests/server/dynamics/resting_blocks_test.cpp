// Skipping of resting blocks: no effect on the felt force, and none to the last bit while nothing is out of balance.
#include "server/dynamics/resting_blocks.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "common/io/spinning_thread_pool.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/explicit_steppers.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

/// A strip of tissue on a table; each block is a row of nodes across it.
LumpedBody strip() { return box_body(16, 60, 6); }

/// A tool that comes down at one end and trembles there.
ToolAt trembling(std::size_t, double t) {
  const double in_m = 0.006 * std::min(1.0, t / 0.1);
  return {Vec3(0.15, 0.1, 5 * kSpacingM + 0.001 - in_m + 0.0001 * std::sin(60 * t)), Vec3::Zero()};
}

struct Felt {
  std::vector<Vec3> forces;  // at the end of each frame [N]
  BodyState state;
  double needed_share = 0;  // mean
};

template <typename Integrator>
Felt touch(double left_out_n, int frames, std::size_t threads = 1) {
  const LumpedBody body = strip();
  const Dynamics dynamics(body);
  const Skin skin(body, 0.03);
  Integrator stepper(dynamics, skin);
  stepper.set_quiescence_tolerance(left_out_n);
  SpinningThreadPool pool(threads);
  stepper.use_threads(pool);
  REQUIRE(stepper.springs() >= ExplicitBody::kWorthSharing);
  Felt felt;
  felt.state = dynamics.rest_state();
  std::vector<ToolPort> ports(1);
  ports[0].parameters = {800, 0.3};
  for (int k = 1; k <= frames; ++k) {
    const AdvanceReport report = stepper.advance(felt.state, ports, 0.05 * k, 0.010, trembling);
    REQUIRE(report.cut_steps == 0);
    felt.needed_share += report.needed_share / frames;
    felt.forces.push_back(ports[0].lambda);
  }
  return felt;
}

double apart_n(const Felt& a, const Felt& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.forces.size(); ++k) most = std::max(most, (a.forces[k] - b.forces[k]).norm());
  return most;
}

}  // namespace

TEST_CASE("Blocks with the least out of balance rest, up to half of what may be left out, and a busy one never") {
  const LumpedBody body = strip();
  const SpringBlocks springs(body);
  RestingBlocks blocks(springs);
  REQUIRE(blocks.blocks() == 360);
  REQUIRE(blocks.all_move());
  std::vector<double> unbalanced(blocks.blocks(), 1.0);
  for (std::size_t b = 0; b < unbalanced.size(); ++b)
    if (b % 60 < 30) unbalanced[b] = 0.01;
  unbalanced[5] = std::numeric_limits<double>::infinity();
  blocks.choose(unbalanced, 4);
  CHECK(blocks.moves(5));
  double left_out = 0;
  for (std::size_t b = 0; b < unbalanced.size(); ++b)
    if (blocks.rests(b)) left_out += unbalanced[b];
  CHECK(left_out == Approx(1.79));  // 179 of 0.01; with one of 1 more it would be beyond 2
  for (std::size_t b = 0; b < unbalanced.size(); ++b) CHECK(blocks.rests(b) == (b % 60 < 30 && b != 5));
}

TEST_CASE("Springs are needed wherever they act on blocks that move or are watched, and nowhere else") {
  const LumpedBody body = strip();
  const SpringBlocks springs(body);
  RestingBlocks blocks(springs);
  std::vector<double> unbalanced(blocks.blocks(), 0.0);
  for (const std::size_t b : {10U, 70U, 130U, 190U, 250U, 310U}) unbalanced[b] = std::numeric_limits<double>::infinity();
  blocks.choose(unbalanced, 1);
  std::vector<std::uint8_t> needed(blocks.blocks(), 0), with_forces(needed);
  for (const bool odd : {false, true})
    for (std::size_t k = 0; k < (odd ? springs.odd_slabs() : springs.even_slabs()).size(); ++k)
      for (const SpringBlocks::Slab& run : blocks.needed(odd, k))
        for (std::size_t b = run.begin; b < run.end; ++b) needed[b] = 1;
  for (const node_loops::Nodes& run : blocks.with_forces())
    for (std::size_t i = run.begin; i < run.end; i += NodeArrays::kBlock) with_forces[i / NodeArrays::kBlock] = 1;
  for (const Element& e : body.elements) {
    const std::size_t a = std::min(e.a, e.b) / NodeArrays::kBlock, b = std::max(e.a, e.b) / NodeArrays::kBlock;
    const bool pulled = blocks.moves(a) || blocks.moves(b);
    if (pulled) CHECK((with_forces[a] && with_forces[b]));
    if (with_forces[a] || with_forces[b]) CHECK(needed[a]);
  }
  CHECK(blocks.needed_share() < 0.15);  // rows 8 to 12 of 60
}

TEST_CASE("Watched blocks move again, the most disturbed first, when all together leave out more than they may") {
  const LumpedBody body = strip();
  const SpringBlocks springs(body);
  RestingBlocks blocks(springs);
  std::vector<double> unbalanced(blocks.blocks(), 0.0);
  unbalanced[10] = std::numeric_limits<double>::infinity();
  blocks.choose(unbalanced, 1);
  const std::vector<std::uint32_t> watched(blocks.watched().begin(), blocks.watched().end());
  REQUIRE(watched.size() == 5);  // 9, 11, and the three above
  blocks.look(std::vector<double>{0.3, 0.1, 0.2, 0.2, 0.1}, 0);
  blocks.renew();
  CHECK(std::all_of(watched.begin(), watched.end(), [&](std::uint32_t b) { return blocks.rests(b); }));
  blocks.look(std::vector<double>{0.5, 0.1, 0.3, 0.2, 0.1}, 0);
  blocks.renew();
  CHECK(blocks.moves(watched[0]));
  CHECK(blocks.moves(watched[2]));
  CHECK(blocks.rests(watched[1]));
  CHECK(blocks.rests(watched[3]));
  blocks.choose(unbalanced, 1);
  constexpr int kRings = 3;
  blocks.look(std::vector<double>{2, 0.1, 0.1, 0.1, 0.1}, kRings);
  for (std::size_t row = 0; row < 60; ++row) CHECK(blocks.moves(row) == (row == 10 || (row >= 9 - kRings && row <= 9 + kRings)));
  blocks.renew();
  blocks.look(std::vector<double>(blocks.watched().size(), std::numeric_limits<double>::infinity()), 0);
  blocks.renew();
  CHECK(std::all_of(watched.begin(), watched.end(), [&](std::uint32_t b) { return blocks.moves(b); }));
  blocks.wake_all();
  CHECK(blocks.all_move());
  CHECK(blocks.needed_share() == 1);
}

TEST_CASE("The less may be left out, the nearer a body that rests in part is to one that moves everywhere") {
  const Felt whole = touch<Leapfrog>(0, 2);
  CHECK(whole.needed_share == 1);
  REQUIRE(whole.forces.back().norm() > 0.1);
  double needed_before = 0;
  for (const double left_out_n : {1e-2, 1e-4, 1e-6}) {
    const Felt resting = touch<Leapfrog>(left_out_n, 2);
    const double stiffness_n_m = 100;  // lower bound for a node that all others hold
    CHECK((resting.state.x - whole.state.x).cwiseAbs().maxCoeff() < left_out_n / stiffness_n_m);
    CHECK(resting.needed_share < 0.95);
    CHECK(resting.needed_share > needed_before);
    needed_before = resting.needed_share;
  }
}

TEMPLATE_TEST_CASE("A hand that trembles on a wide body feels no more of what rests than that leaves out, at half of the springs",
                   "", Leapfrog, Stabilised) {
  constexpr double kLeftOutN = 0.01;
  const Felt whole = touch<TestType>(0, 8), resting = touch<TestType>(kLeftOutN, 8);
  REQUIRE(whole.forces.back().norm() > 0.5);
  CHECK(apart_n(whole, resting) < kLeftOutN);
  CHECK(apart_n(whole, resting) > 0);
  CHECK(resting.needed_share < 0.75);
}

TEMPLATE_TEST_CASE("A body that rests in part moves to the same bits whatever the number of threads", "", Leapfrog, Stabilised) {
  const Felt one = touch<TestType>(0.01, 3);
  for (const std::size_t threads : {2, 3}) {
    const Felt shared = touch<TestType>(0.01, 3, threads);
    CHECK(shared.state.x == one.state.x);
    CHECK(shared.state.v == one.state.v);
    CHECK(shared.needed_share == one.needed_share);
  }
}
