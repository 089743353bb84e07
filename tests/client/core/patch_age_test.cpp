// The haptic tick with patches that become old, leave their trust radius, or stop coming: they fade without a jump.
#include <catch2/catch.hpp>
#include <cmath>

#include "client/core/haptic_tick.hpp"
#include "tests/client/core/ticking_hand.hpp"

using namespace palpate;
using test::constant;
using test::Hand;
using test::kEpoch;

TEST_CASE("A patch older than it may be fades to nothing in 50 ticks, and a fresh one fades in") {
  Hand hand;
  hand.give(constant(Vec3(0, 0, 2), 1, hand.now(), Micros{200'000}));
  for (int k = 1; k <= 50; ++k) CHECK(hand.tick().force.z() == Approx(2.0 * k / 50));
  const TickOutput whole = hand.ticks(150);
  CHECK(whole.gain == 1);
  CHECK_FALSE(whole.outlived);
  for (int k = 1; k <= 50; ++k) {
    const TickOutput out = hand.tick();
    CHECK(out.force.z() == Approx(2.0 * (50 - k) / 50).margin(1e-12));
    CHECK(out.gain == Approx((50 - k) / 50.0).margin(1e-12));
    CHECK(out.outlived);
  }
  CHECK(hand.ticks(100).force.norm() == 0);
  hand.give(constant(Vec3(0, 0, 2), 2, hand.now()));
  double last = 0;
  for (int k = 1; k <= 60; ++k) {
    const double now = hand.tick().force.z();
    CHECK(now >= last);
    CHECK(now - last < 0.2);
    last = now;
  }
  CHECK(last == Approx(2));
}

TEST_CASE("A patch that is renewed is as young as the moment up to which it is, and fades when that is too long ago") {
  Hand hand;
  hand.give(constant(Vec3(0, 0, 2), 1, hand.now(), Micros{200'000}));
  hand.ticks(100);
  for (int k = 0; k < 60; ++k) {
    const bool another = k % 8 == 7;  // none is renewed for more than a second
    const Micros stamp = hand.now() - Micros{70'000};
    if (another)
      hand.give(constant(Vec3(0, 0, 2), static_cast<std::uint32_t>(k), stamp, Micros{200'000}));
    else
      hand.haptic.renew_to(stamp);
    const TickOutput first = hand.tick();
    CHECK(first.patch_age <= Micros{72'000});
    CHECK(first.swapped == another);
    const TickOutput out = hand.ticks(99);
    CHECK_FALSE(out.outlived);
    CHECK(out.force.z() == Approx(2));
  }
  CHECK(hand.haptic.horizon() >= Micros{165'000});
  CHECK(hand.haptic.horizon() <= Micros{185'000});
  CHECK(hand.ticks(30).gain == 1);
  CHECK(hand.ticks(60).force.norm() == 0);
}

TEST_CASE("A force that the device cannot show fades from and to what it can") {
  Hand hand(PassivityMode::off, 8.5);
  hand.give(constant(Vec3(0, 0, 80), 1, hand.now(), Micros{200'000}));
  for (int k = 1; k <= 50; ++k) CHECK(hand.tick().force.z() == Approx(8.5 * k / 50));
  hand.ticks(150);
  for (int k = 1; k <= 50; ++k) CHECK(hand.tick().force.z() == Approx(8.5 * (50 - k) / 50).margin(1e-12));
}

TEST_CASE("A tool beyond the trust radius feels the patch fade, and feels it again when it returns") {
  Hand hand;
  hand.give(constant(Vec3(0, 0, 2), 1, hand.now()));
  CHECK(hand.ticks(100).force.z() == Approx(2));
  CHECK(hand.tick(Vec3(0.051, 0, 0)).force.z() == Approx(2 * 0.98));
  const TickOutput away = hand.ticks(60, Vec3(0.051, 0, 0));
  CHECK(away.force.norm() == 0);
  CHECK(away.gain == 0);
  CHECK_FALSE(away.outlived);
  CHECK(hand.ticks(60, Vec3(0.049, 0, 0)).force.z() == Approx(2));
}

TEST_CASE("The age that patches reach before the next takes over is known, and a pause does not count") {
  Hand hand;
  CHECK(hand.haptic.horizon() == Micros{0});
  std::uint32_t seq = 0;
  const auto swap = [&] { hand.give(constant(Vec3(1, 0, 0), ++seq, hand.now() - Micros{30'000}, Micros{500'000})); };
  for (int k = 0; k < 100; ++k) {
    swap();
    hand.ticks(50);
  }
  const auto horizon = hand.haptic.horizon();
  CHECK(horizon >= Micros{80'000});
  CHECK(horizon <= Micros{83'000});
  hand.ticks(3000);
  swap();
  hand.tick();
  CHECK(hand.haptic.horizon() == horizon);
}

TEST_CASE("Patches whose way became longer than they are valid for are known to be older before long") {
  Hand hand;
  std::uint32_t seq = 0;
  const auto swaps = [&](int count, Micros way) {
    for (int k = 0; k < count; ++k) {
      hand.give(constant(Vec3(1, 0, 0), ++seq, hand.now() - way, 2 * hand.haptic.horizon() + Micros{250'000}));
      hand.ticks(20);
    }
  };
  swaps(100, Micros{5'000});
  REQUIRE(hand.haptic.horizon() < Micros{30'000});
  swaps(10, Micros{340'000});
  CHECK(hand.haptic.horizon() > Micros{150'000});
  swaps(200, Micros{340'000});
  CHECK(hand.haptic.horizon() >= Micros{360'000});
  CHECK(hand.haptic.horizon() < Micros{370'000});
  CHECK(hand.ticks(1).force.x() == Approx(1));
}

TEST_CASE("After a gap between ticks the force begins at zero and fades in, and a patch that is too old by then is forgotten") {
  const Micros gap = GENERATE(Micros{25'000}, Micros{3'000'000});
  LatestSlot<PatchPlayer> slot;
  SampleRing ring;
  HapticTick haptic(slot, ring, GuardLimits{});
  Patch patch = constant(Vec3(4, 0, 0), 1, kEpoch, Micros{300'000});
  const auto give = [&](Micros stamp) {
    patch.stamp = stamp;
    ++patch.seq;
    slot.back() = PatchPlayer(patch);
    slot.publish();
  };
  give(kEpoch);
  for (int ms = 1; ms <= 100; ++ms) haptic.tick({kEpoch + ms * kTick, Vec3::Zero()});
  const Micros back = kEpoch + 100 * kTick + gap;
  const TickOutput first = haptic.tick({back, Vec3(0.02, 0, 0)});
  CHECK(first.force.norm() == 0);
  CHECK(first.has_patch == (gap < Micros{300'000}));
  patch.force = Vec3(-5, 0, 0);
  give(back);
  double before = 0;
  for (int ms = 1; ms <= 200; ++ms) {
    const double force = haptic.tick({back + ms * kTick, Vec3(0.02, 0, 0)}).force.x();
    CHECK(std::abs(force - before) < 0.25);
    before = force;
  }
  CHECK(before == -5);
  CHECK(haptic.guard_counts().restarts == 1);
}

TEST_CASE("A player from before a pause is not made up for") {
  Hand hand;
  hand.give(constant(Vec3(1, 0, 0), 1, hand.now(), Micros{4'000'000}));
  hand.ms += 1500;
  const TickOutput out = hand.tick();
  CHECK_FALSE(out.has_patch);
  CHECK(out.force.norm() == 0);
}

TEST_CASE("However long a server says that a patch is good, it is for 5 s, and for 1 s beyond the usual age once that is known") {
  Hand hand;
  const auto lasts = [&] {
    Micros began = hand.now();
    while (hand.tick().gain == 1) REQUIRE(hand.now() - began < Micros{20'000'000});
    return hand.now() - began;
  };
  hand.give(constant(Vec3(1, 0, 0), 1, hand.now(), Micros{60'000'000}));
  hand.ticks(100);
  CHECK(lasts() == kValidMost - 99 * kTick);
  for (std::uint32_t seq = 2; seq < 200; ++seq) {
    hand.give(constant(Vec3(1, 0, 0), seq, hand.now() - Micros{30'000}, Micros{60'000'000}));
    hand.ticks(50);
  }
  const Micros usual = hand.haptic.horizon();
  CHECK(usual < Micros{200'000});
  hand.give(constant(Vec3(1, 0, 0), 200, hand.now(), Micros{60'000'000}));
  CHECK(lasts() <= kValidBeyondAge + usual + kTick);
  CHECK(hand.ticks(60).force.norm() == 0);
}

TEST_CASE("A patch is renewed for a second after its stamp, however often a server says so") {
  Hand hand;
  hand.give(constant(Vec3(1, 0, 0), 1, hand.now(), Micros{300'000}));
  const Micros stamp = hand.now();
  for (int ms = 0; ms < 1290; ++ms) {
    hand.haptic.renew_to(hand.now());
    const TickOutput out = hand.tick();
    if (ms > 60) CHECK(out.force.x() == 1);
    CHECK(out.patch_stamp <= stamp + kRenewedMost);
  }
  for (int ms = 0; ms < 100; ++ms) {
    hand.haptic.renew_to(hand.now());
    hand.tick();
  }
  CHECK(hand.tick().force.norm() == 0);
}

TEST_CASE("When the server is not there any more the force fades within 50 ms, and comes back with it") {
  Hand hand;
  hand.give(constant(Vec3(3, 0, 0), 1, hand.now()));
  CHECK(hand.ticks(100).force.x() == 3);
  hand.haptic.server_until(hand.now() + 10 * kTick);
  CHECK(hand.ticks(10).force.x() == 3);
  double before = 3;
  for (int ms = 1; ms <= 50; ++ms) {
    const double force = hand.tick().force.x();
    CHECK(before - force < 0.07);
    before = force;
  }
  CHECK(before == 0);
  hand.haptic.server_until(hand.now() + Micros{1'000'000});
  CHECK(hand.ticks(60).force.x() == 3);
}
