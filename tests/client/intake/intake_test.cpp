// The network side of the hand-over: catching up, order, age.
#include "client/intake/intake.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "tests/support/patches.hpp"

using namespace palpate;

namespace {

constexpr Micros kIntakeEpoch{1'000'000}, kNow = kIntakeEpoch + 200 * kTick;

ToolSample sample_at(int ms) {
  return {kIntakeEpoch + ms * kTick,
          Vec3(0.003 * std::sin(0.02 * ms), 0.002 * std::cos(0.03 * ms), 0.004 * std::cos(0.015 * ms) - 0.001)};
}

struct Side {
  std::unique_ptr<LatestSlot<PatchPlayer>> slot = std::make_unique<LatestSlot<PatchPlayer>>();
  PatchIntake intake{*slot};
};

}  // namespace

TEST_CASE("A patch that comes late is caught up to the same bits as one played from its stamp on") {
  const bool touch = GENERATE(false, true);
  Side side;
  for (int ms = 0; ms <= 300; ++ms) side.intake.add_sample(sample_at(ms));
  const Micros stamp = kIntakeEpoch + 100 * kTick + Micros{GENERATE(0, 300, 700)};
  const Patch patch = touch ? test::touch_patch(8, 1, stamp) : test::attach_patch(11, 1, stamp);
  REQUIRE(side.intake.accept(patch, kNow));
  PatchPlayer* caught_up = side.slot->take();
  REQUIRE(caught_up != nullptr);
  PatchPlayer played(patch);
  for (int ms = 101; ms <= 300; ++ms) played.advance(sample_at(ms));
  for (int ms = 300; ms <= 400; ++ms) {
    if (ms > 300) {
      caught_up->advance(sample_at(ms));
      played.advance(sample_at(ms));
    }
    CHECK(caught_up->output().force == played.output().force);
    CHECK(caught_up->output().contact == played.output().contact);
    CHECK(caught_up->energy() == played.energy());
    CHECK(caught_up->time() == played.time());
  }
}

TEST_CASE("Patches that are old news, older than memory or from the future are counted and left") {
  Side side;
  for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
  CHECK(side.intake.accept(test::attach_patch(3, 7, kIntakeEpoch + 50 * kTick), kNow));
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 7, kIntakeEpoch + 60 * kTick), kNow));
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 6, kIntakeEpoch + 60 * kTick), kNow));
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 8, kIntakeEpoch - 5 * kTick), kNow));
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 9, kIntakeEpoch + 230 * kTick), kNow));
  CHECK(side.intake.counts().accepted == 1);
  CHECK(side.intake.counts().stale == 2);
  CHECK(side.intake.counts().too_old == 1);
  CHECK(side.intake.counts().from_future == 1);
  side.intake.reset();
  CHECK(side.intake.accept(test::attach_patch(3, 1, kIntakeEpoch + 60 * kTick), kNow));
}

TEST_CASE("A patch that waited while the network side stood still is played, although the samples of that time were lost") {
  Side side;
  for (int ms = 0; ms <= 1000; ++ms) side.intake.add_sample(sample_at(ms));  // as many as the ring holds
  const Micros now = kIntakeEpoch + 2200 * kTick;
  CHECK(side.intake.accept(test::attach_patch(3, 1, kIntakeEpoch + 1900 * kTick), now));
  PatchPlayer* const player = side.slot->take();
  REQUIRE(player != nullptr);
  CHECK(player->advance({now, Vec3::Zero()}).force.allFinite());
  CHECK(player->time() == now);
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 2, now + PatchIntake::kFutureMax + kTick), now));
}

TEST_CASE("Sequence numbers go on past their wrap") {
  Side side;
  for (int ms = 0; ms <= 20; ++ms) side.intake.add_sample(sample_at(ms));
  CHECK(side.intake.accept(test::attach_patch(3, 0xffffffffu, kIntakeEpoch + 5 * kTick), kNow));
  CHECK(side.intake.accept(test::attach_patch(3, 0, kIntakeEpoch + 6 * kTick), kNow));
  CHECK_FALSE(side.intake.accept(test::attach_patch(3, 0xffffffffu, kIntakeEpoch + 6 * kTick), kNow));
}

namespace {

/// Felt motion after the pieces of a nonlinear patch arrive in the given `order`, -1 being the patch itself.
std::vector<Vec3> felt(Side& side, const Patch& patch, const std::vector<PatchTerms>& pieces, const std::vector<int>& order) {
  for (const int k : order) {
    if (k < 0)
      REQUIRE(side.intake.accept(patch, kNow));
    else
      CHECK(side.intake.accept(pieces[static_cast<std::size_t>(k)]));
  }
  PatchPlayer* const player = side.slot->take();
  REQUIRE(player != nullptr);
  std::vector<Vec3> forces;
  for (int ms = 201; ms <= 260; ++ms) forces.push_back(player->advance(sample_at(ms)).force);
  return forces;
}

}  // namespace

TEST_CASE("The pieces of a patch's terms bend it in any order, before or after the patch, and without one of them it is linear") {
  const Patch patch = test::attach_patch(11, 5, kIntakeEpoch + 100 * kTick);
  const NonlinearTerms terms = test::many_spring_terms(patch);
  const std::vector<PatchTerms> pieces = to_pieces(terms, patch.seq);
  REQUIRE(pieces.size() == 3);
  TermsAssembly assembly;
  for (const PatchTerms& piece : pieces) CHECK(assembly.take(piece));
  const auto received = assembly.terms_for(patch);
  REQUIRE(received);
  PatchPlayer nonlinear(patch, *received), linear(patch);
  for (int ms = 101; ms <= 200; ++ms) {
    nonlinear.advance(sample_at(ms));
    linear.advance(sample_at(ms));
  }
  for (const std::vector<int>& order : {std::vector<int>{-1, 0, 1, 2}, {2, 1, -1, 0}, {1, 2, 0, -1}, {-1, 0, 2}}) {
    Side side;
    for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
    const bool whole = order.size() == 4;
    const auto forces = felt(side, patch, pieces, order);
    CHECK(side.intake.counts().with_terms == (whole ? 1 : 0));
    PatchPlayer expected = whole ? nonlinear : linear;
    for (int ms = 201; ms <= 260; ++ms)
      CHECK(forces[static_cast<std::size_t>(ms - 201)] == expected.advance(sample_at(ms)).force);
    CHECK(side.intake.accept(test::attach_patch(11, 6, kIntakeEpoch + 150 * kTick), kNow));
    CHECK_FALSE(side.intake.accept(pieces[2]));
  }
  CHECK(nonlinear.output().force != linear.output().force);
}

TEST_CASE("Terms that do not fit their patch, or of another whole, do not bend it") {
  Side side;
  for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
  const Patch patch = test::attach_patch(11, 5, kIntakeEpoch + 100 * kTick);
  REQUIRE(side.intake.accept(patch, kNow));
  for (const PatchTerms& piece : to_pieces(test::many_spring_terms(test::attach_patch(9, 5, patch.stamp)), 5))
    side.intake.accept(piece);
  CHECK(side.intake.counts().with_terms == 0);
  auto pieces = to_pieces(test::many_spring_terms(patch), 6);
  CHECK(side.intake.accept(pieces[0]));
  CHECK_FALSE(side.intake.accept(pieces[0]));
  pieces[1].stiffening = 2;
  CHECK_FALSE(side.intake.accept(pieces[1]));
  CHECK(side.intake.counts().stale_terms == 2);
}

namespace {

/// A patch of scheme hyper and the pieces of its terms, `size` times as strong as usual.
struct NonlinearPatch {
  Patch patch;
  std::vector<PatchTerms> pieces;
  NonlinearPatch(std::uint32_t seq, int stamp_ms, float size)
      : patch(test::attach_patch(11, seq, kIntakeEpoch + stamp_ms * kTick)) {
    patch.scheme = Scheme::hyper;
    patch.has_terms = true;
    NonlinearTerms terms = test::spring_terms(patch);
    terms.elements.stiffness *= size;
    terms.elements.damping *= size;
    pieces = to_pieces(terms, seq);
  }
};

void give(Side& side, const NonlinearPatch& nonlinear) {
  REQUIRE(side.intake.accept(nonlinear.patch, kNow));
  for (const PatchTerms& piece : nonlinear.pieces) CHECK(side.intake.accept(piece));
}

}  // namespace

TEST_CASE("While its terms are on their way a patch waits when the one before, nonlinear, is the truer") {
  Side side;
  for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
  // The same patch at the same stamp, so that the only difference is that of the terms.
  for (std::uint32_t seq = 1; seq <= 3; ++seq) give(side, NonlinearPatch(seq, 100, 1));
  CHECK(side.intake.counts().held_back == 2);
  CHECK(side.intake.counts().with_terms == 3);
  REQUIRE(side.slot->take() != nullptr);
  const NonlinearPatch next(4, 100, 1);
  CHECK(side.intake.accept(next.patch, kNow));
  CHECK(side.slot->take() == nullptr);
  // A patch of another scheme is the server's answer to a case without terms, so none will come.
  CHECK(side.intake.accept(test::attach_patch(11, 5, next.patch.stamp), kNow));
  REQUIRE(side.slot->take() != nullptr);
  CHECK(side.intake.accept(NonlinearPatch(6, 100, 1).patch, kNow));
  CHECK(side.slot->take() != nullptr);
}

TEST_CASE("Patches wait again as soon as the one before is the truer again, however long they did not") {
  Side side;
  for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
  give(side, NonlinearPatch(1, 100, 0));
  std::uint32_t seq = 2;
  for (; seq < 20; ++seq) {  // each far from the one before, and linear: no patch waits
    NonlinearPatch off(seq, 100, 0);
    off.patch.force += Vec3(0, 0, seq % 2 == 0 ? 0.001 : 0);
    give(side, off);
  }
  const std::uint64_t held = side.intake.counts().held_back;
  CHECK(held < 3);
  for (; seq < 40; ++seq) give(side, NonlinearPatch(seq, 100, 1));
  CHECK(side.intake.counts().held_back > held + 10);
}

TEST_CASE("A patch does not wait for terms that bend it less than the one before is off, nor for a lost one for ever") {
  Side side;
  for (int ms = 0; ms <= 200; ++ms) side.intake.add_sample(sample_at(ms));
  give(side, NonlinearPatch(1, 60, 0));
  NonlinearPatch off(2, 100, 0);
  off.patch.force += Vec3(0, 0, 0.5);
  give(side, off);
  const std::uint64_t held = side.intake.counts().held_back;
  REQUIRE(side.slot->take() != nullptr);
  CHECK(side.intake.accept(NonlinearPatch(3, 100, 0).patch, kNow));
  CHECK(side.slot->take() != nullptr);
  CHECK(side.intake.counts().held_back == held);

  Side lossy;
  for (int ms = 0; ms <= 200; ++ms) lossy.intake.add_sample(sample_at(ms));
  give(lossy, NonlinearPatch(1, 100, 1));
  REQUIRE(lossy.slot->take() != nullptr);
  std::uint32_t seq = 1;
  while (seq < 20 && lossy.slot->take() == nullptr) lossy.intake.accept(NonlinearPatch(++seq, 100, 1).patch, kNow);
  CHECK(seq > 2);
  CHECK(seq < 10);
}

TEST_CASE("While this clock stood still numbers went on, for three seconds at most, and no further than that") {
  constexpr double kRateHz = 50;
  constexpr Micros kSlept{600'000}, kWoken{20'000}, kForever{60'000'000};
  // 600 ms give 30 patches, 3 s give 150; both plus a quarter and eight.
  struct Case {
    Micros stood;
    std::uint32_t lead;
    bool taken;
  };
  for (const Case c :
       {Case{{}, 31, false}, {kSlept, 31, true}, {kSlept, 48, false}, {kForever, 190, true}, {kForever, 200, false}}) {
    Side side;
    side.intake.expect(kRateHz);
    for (int ms = 0; ms <= 300; ++ms) side.intake.add_sample(sample_at(ms));
    Patch patch = test::attach_patch(11, 1, kNow - kWoken);
    REQUIRE(side.intake.accept(patch, kNow));
    side.intake.stood_still(c.stood);
    patch.seq += c.lead;
    patch.stamp += kWoken;
    INFO(c.stood.count() << " us, " << c.lead << " further");
    CHECK(side.intake.accept(patch, kNow + kWoken) == c.taken);
    CHECK(side.intake.counts().jumped == (c.taken ? 0u : 1u));
  }
}
