// The haptic tick: hand-over without jumps, the coupling, and no NaN.
#include "client/core/haptic_tick.hpp"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <cmath>

#include "client/intake/intake.hpp"
#include "tests/client/core/ticking_hand.hpp"

using namespace palpate;
using test::constant;
using test::Hand;
using test::kEpoch;

TEST_CASE("Without a patch there is no force") {
  Hand hand;
  const TickOutput out = hand.ticks(10, Vec3::Ones());
  CHECK(out.force.norm() == 0);
  CHECK_FALSE(out.has_patch);
}

TEST_CASE("The step at a swap is measured and decays linearly to nothing") {
  Hand hand;
  hand.give(constant(Vec3(1, 0, 0), 1, hand.now()));
  CHECK(hand.ticks(100).force == Vec3(1, 0, 0));
  hand.give(constant(Vec3(3, 0, 0), 2, hand.now()));
  const TickOutput swap = hand.tick();
  CHECK(swap.swapped);
  CHECK(swap.hand_over_step_n == Approx(2));
  CHECK(hand.haptic.counts().hand_over_step_max_n == Approx(2));
  CHECK(swap.force.x() == Approx(1));
  for (int k = 1; k <= 16; ++k) {  // 2 N in 14 steps of less than 5 % of 3 N
    const TickOutput out = hand.tick();
    CHECK_FALSE(out.swapped);
    CHECK(out.force.x() == Approx(std::min(1 + 2.0 / 14 * k, 3.0)));
  }
}

TEST_CASE(
    "A step that a hand does not notice is gone in four ticks, a larger one moves the force no faster in 5 ms, a large one in "
    "1") {
  struct Row {
    double step_n, force_n;
    int ticks;
  };
  const auto row = GENERATE(Row{0.02, 0.5, 4}, Row{0.04, 0.5, 4}, Row{0.069, 0.5, 7}, Row{0.07, 2, 4}, Row{0.19, 4, 5},
                            Row{0.4, 1, 10}, Row{0.61, 1, 13}, Row{5, 1, 25});
  Hand hand;
  hand.give(constant(Vec3(row.force_n - row.step_n, 0, 0), 1, hand.now()));
  hand.ticks(100);
  hand.give(constant(Vec3(row.force_n, 0, 0), 2, hand.now()));
  for (int k = 0; k < row.ticks; ++k)
    CHECK(hand.tick().force.x() == Approx(row.force_n - row.step_n * (row.ticks - k) / row.ticks).margin(1e-12));
  CHECK(hand.tick().force.x() == Approx(row.force_n));
}

TEST_CASE("Swaps in the middle of a cross-fade do not jump either") {
  Hand hand;
  hand.give(constant(Vec3(1, 0, 0), 1, hand.now()));
  double last = hand.ticks(100).force.x();
  for (std::uint32_t k = 0; k < 200; ++k) {
    if (k % 3 != 1) hand.give(constant(Vec3(k % 2 ? 2 : 0.5, 0, 0), 2 + k, hand.now()));
    const TickOutput out = hand.tick();
    CHECK(std::abs(out.force.x() - last) <= 1.5);
    if (out.swapped) CHECK(out.force.x() == Approx(last).margin(1.5 / 4 + 1e-12));
    last = out.force.x();
  }
}

TEST_CASE("The first contact of an anticipating patch is felt at once") {
  Hand hand;
  Patch p = test::touch_patch(8, 1, hand.now());
  p.tool = Vec3(0, 0, 0.003);
  hand.give(p);
  CHECK(hand.ticks(5, Vec3(0.001, 0.002, 0.003)).force.norm() == 0);
  PatchPlayer alone(p);
  for (int k = 1; k <= 5; ++k) alone.advance({kEpoch + k * kTick, Vec3(0.001, 0.002, 0.003)});
  const TickOutput out = hand.tick(Vec3(0.001, 0.002, -0.002));
  CHECK(out.contact);
  CHECK(out.force == alone.advance({hand.now(), Vec3(0.001, 0.002, -0.002)}).force);
  CHECK(out.force.norm() > 0);
}

TEST_CASE("A player is replayed over the ticks that the network side had not seen") {
  Hand hand;
  const auto tool = [](int ms) { return Vec3(0.002 * std::sin(0.05 * ms), 0, 0.001 * std::cos(0.04 * ms)); };
  const Patch p = test::attach_patch(6, 1, hand.now());
  PatchPlayer alone(p);
  for (int k = 1; k <= 30; ++k) hand.tick(tool(k));
  hand.give(p);
  for (int k = 1; k <= 90; ++k) alone.advance({kEpoch + k * kTick, tool(k)});
  TickOutput out;
  for (int k = 31; k <= 90; ++k) out = hand.tick(tool(k));
  CHECK(out.force == alone.output().force);
}

TEST_CASE(
    "A tool position that is no number or out of the world never reaches the force, and its patch goes on as if the tool had "
    "stood still") {
  const bool touch = GENERATE(false, true);
  Hand hand, other;
  const double bad = GENERATE(std::nan(""), INFINITY, 1e6);
  for (int k = 0; k < 600; ++k) {
    if (k % 50 == 0)
      for (Hand* h : {&hand, &other})
        h->give(touch ? test::touch_patch(6, static_cast<std::uint32_t>(k + 1), h->now())
                      : test::attach_patch(6, static_cast<std::uint32_t>(k + 1), h->now()));
    const auto tool = [](int at) { return Vec3(0.002 * std::sin(0.05 * at), 0, 0.001 * std::cos(0.04 * at)); };
    const bool spoilt = k == 120 || k == 149 || k == 150;
    const TickOutput out = hand.tick(spoilt ? Vec3(bad, 0, bad) : tool(k));
    const TickOutput good = other.tick(spoilt ? tool(k == 120 ? 119 : 148) : tool(k));
    REQUIRE(out.force.allFinite());
    CHECK(out.force == good.force);
    if (!touch && k > 200) CHECK(out.force.norm() > 0);
  }
}

TEST_CASE("Through a virtual coupling the hand meets coupling and patch in series, and the server the virtual tool") {
  LatestSlot<PatchPlayer> slot;
  SampleRing ring;
  HapticTick haptic(slot, ring, GuardLimits{}, {600, 0.5, 0});
  Patch patch = constant(Vec3::Zero(), 1, kEpoch);
  patch.constant = false;
  patch.scheme = Scheme::tangent;
  patch.contact = ContactKind::attach;
  patch.k_port = 300 * Mat3::Identity();
  slot.back() = PatchPlayer(patch);
  slot.publish();
  const Vec3 tool(0.004, 0, -0.002);
  TickOutput out = haptic.tick({kEpoch + kTick, Vec3::Zero()});
  for (int ms = 2; ms < 500; ++ms) out = haptic.tick({kEpoch + ms * kTick, tool});
  const double series = 1 / (1 / 600.0 + 1 / 300.0);
  CHECK((out.force + series * tool).norm() < 1e-9);
  ToolSample last;
  while (ring.pop(last)) {
  }
  CHECK((last.position - series / 300 * tool).norm() < 1e-12);
}

namespace {

/// Largest excursion, in the last of `seconds`, of a device of 75 g and 0.5 N s/m joined to a patch of 5000 N/m and released 1 mm
/// off.
double excursion_m(const CouplingParameters& coupling, int seconds) {
  LatestSlot<PatchPlayer> slot;
  SampleRing ring;
  HapticTick haptic(slot, ring, GuardLimits{100, 0, PassivityMode::off}, coupling);
  Patch patch = constant(Vec3::Zero(), 1, kEpoch);
  patch.constant = false;
  patch.scheme = Scheme::tangent;
  patch.contact = ContactKind::attach;
  patch.k_port = 5000 * Mat3::Identity();
  slot.back() = PatchPlayer(patch);
  slot.publish();
  constexpr int kSubSteps = 100;
  double x = 1e-3, v = 0, most = 0;
  for (int ms = 1; ms <= 1000 * seconds; ++ms) {
    const double force = haptic.tick({kEpoch + ms * kTick, Vec3(x, 0, 0)}).force.x();
    for (int k = 0; k < kSubSteps; ++k) {
      v += 1e-3 / kSubSteps * (force - 0.5 * v) / 0.075;
      x += 1e-3 / kSubSteps * v;
    }
    if (ms > 1000 * (seconds - 1)) most = std::max(most, std::abs(x));
  }
  return most;
}

}  // namespace

TEST_CASE("A device with little damping oscillates on a stiff patch, and comes to rest through a passive coupling") {
  CHECK(excursion_m({}, 3) > 3e-3);
  REQUIRE(passive_stiffness_n_m(0.5, 0.1, 1e-3) > 600);
  CHECK(excursion_m({600, 0.1, 0}, 6) < 1e-5);
}

TEST_CASE("Energy that a swap of patches injects is observed, and taken out again where the limiter is on") {
  // In by 10 mm against 1 N; a swap makes it 2 N; out by 10 mm: the display returns 10 mJ more than it received.
  constexpr double kDepthM = 0.010, kBeforeN = 1, kAfterN = 2;
  constexpr int kTicks = 50;  // at 0.2 m/s the damper may remove more than the 2 N
  const double injected_j = (kAfterN - kBeforeN) * kDepthM;
  const auto given = [&](PassivityMode mode, GuardCounts& counts) {
    Hand hand(mode);
    hand.give(constant(Vec3(0, 0, kBeforeN), 1, hand.now()));
    hand.ticks(100);
    double work_j = 0, z = 0;
    Vec3 force = hand.tick().force;
    const auto move = [&](double to) {
      work_j += force.z() * (to - z);  // held over the tick, as by a device
      z = to;
      force = hand.tick(Vec3(0, 0, z)).force;
    };
    for (int k = 1; k <= kTicks; ++k) move(-kDepthM * k / kTicks);
    hand.give(constant(Vec3(0, 0, kAfterN), 2, hand.now()));
    for (int k = 0; k < 20; ++k) move(z);
    for (int k = 1; k <= kTicks; ++k) move(-kDepthM * (kTicks - k) / kTicks);
    counts = hand.haptic.guard_counts();
    return work_j;
  };
  GuardCounts off, observed, on;
  CHECK(given(PassivityMode::off, off) == Approx(injected_j).epsilon(0.01));
  CHECK(off.energy_min_j == 0);
  CHECK(given(PassivityMode::observe, observed) == Approx(injected_j).epsilon(0.01));
  CHECK(observed.energy_min_j == Approx(-injected_j).epsilon(0.01));
  CHECK(observed.damped == 0);
  CHECK(observed.dissipated_j == 0);
  const double left_j = given(PassivityMode::on, on);
  INFO("left " << left_j << " J, dissipated " << on.dissipated_j << " J");
  CHECK(std::abs(left_j) < 1.2 * Passivity::kFullJ);  // the deficit needed to stop the display
  CHECK(on.dissipated_j == Approx(injected_j - left_j).epsilon(0.01));
  CHECK(on.damped > 20);
  CHECK(on.damper_rms_n() > 0.5 * (kAfterN - kBeforeN));
}

TEST_CASE("What a patch shows a hand of stiffness is that of its port, and a device that renders less shows it weaker") {
  Patch grasp = test::attach_patch(6, 1, kEpoch);
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(grasp.k_port);
  CHECK(stiffness_of_port(grasp) == Approx(eigen.eigenvalues().maxCoeff()));
  CHECK(stiffness_of_port(constant(Vec3(1, 0, 0), 1, kEpoch)) == 0);

  // For a touch: the response to a slow push along the normal.
  Patch touch = test::touch_patch(6, 1, kEpoch);
  touch.contact_stiffness_n_m = 500;
  PatchPlayer player(touch);
  const auto pressed = [&](double depth) {
    Vec3 force = Vec3::Zero();
    for (int ms = 1; ms <= 4000; ++ms) force = player.advance({player.time() + kTick, Vec3(0.001, 0.002, -depth)}).force;
    return force.norm();
  };
  const double slope = (pressed(0.0022) - pressed(0.002)) / 0.0002;
  CHECK(stiffness_of_port(touch) == Approx(slope).epsilon(0.15));

  GuardLimits limits;
  limits.stiffness_max_n_m = 100;
  Hand stiff;
  stiff.haptic.limit(limits);
  Patch patch = constant(Vec3::Zero(), 1, stiff.now());
  patch.constant = false;
  patch.scheme = Scheme::tangent;
  patch.contact = ContactKind::attach;
  patch.k_port = 400 * Mat3::Identity();
  stiff.give(patch);
  CHECK(stiff.ticks(100, Vec3(0.01, 0, 0)).force.x() == Approx(-1));
  stiff.give(patch);  // the same once more, as when its terms arrive
  stiff.ticks(10, Vec3(0.01, 0, 0));
  CHECK(stiff.haptic.counts().softened == 1);
  CHECK(stiff.haptic.counts().softened_most == Approx(0.25));
  // A softer patch with the same force takes over without a step of the displayed force.
  patch.k_port = 50 * Mat3::Identity();
  patch.seq = 2;
  patch.stamp = stiff.now();
  stiff.give(patch);
  CHECK(stiff.tick(Vec3(0.01, 0, 0)).force.x() == Approx(-1));
  CHECK(stiff.ticks(100, Vec3(0.01, 0, 0)).force.x() == Approx(-0.5));
}
