// Forces under the worst network conditions: duplicated and reordered datagrams, a path that changes, silence.
#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr Micros kFade{50'000};

/// Largest change of force from tick to tick, from tick `from` on.
double largest_step(const std::vector<TickOutput>& ticks, std::size_t from) {
  double step = 0;
  for (std::size_t i = std::max<std::size_t>(from, 1); i < ticks.size(); ++i)
    step = std::max(step, (ticks[i].force - ticks[i - 1].force).norm());
  return step;
}

}  // namespace

TEST_CASE("datagrams that all come twice change nothing that is felt") {
  const auto felt = [](double duplicate) {
    SmallWorld world;
    world.link = {30ms, 0ms, 0.0, duplicate};
    world.add(1, "hand");
    world.run(3s);
    std::vector<Vec3> forces;
    for (const TickOutput& tick : world.places[1].ticks) forces.push_back(tick.force);
    return forces;
  };
  CHECK(felt(0) == felt(1));
}

TEST_CASE("datagrams out of order never bring back an older patch") {
  SmallWorld world;
  world.link = {60ms, 120ms, 0.0, 0.3};  // up to 120 ms apart: frames 50 ms apart overtake each other
  auto& hand = world.add(1, "hand");
  world.run(8s);
  Micros stamp{};
  for (const TickOutput& tick : world.places[1].ticks) {
    if (!tick.has_patch) continue;
    REQUIRE(tick.patch_stamp >= stamp);
    stamp = tick.patch_stamp;
  }
  CHECK(hand.intake_counts().stale > 10);
  CHECK(hand.loss().late > 10);
}

TEST_CASE("a path that changes by 100 ms, there and back, leaves patches coming and their ages right") {
  SmallWorld world;
  world.link.delay = 20ms;
  auto& hand = world.add(1, "hand", 33s);
  world.run(5s);
  for (const Micros delay : {Micros{120ms}, Micros{20ms}}) {
    world.link.delay = delay;
    const std::size_t from = world.places[1].ticks.size();
    world.run(6s);
    const auto& ticks = world.places[1].ticks;
    CHECK(ticks.back().has_patch);
    CHECK(ticks.back().patch_age >= 2 * delay - 1ms);
    CHECK(ticks.back().patch_age <= 2 * delay + 50ms + 10ms);
    CHECK(largest_step(ticks, from) < 0.05);
    CHECK(hand.link() == LinkState::joined);
  }
  CHECK(hand.intake_counts().from_future == 0);
}

TEST_CASE("a link that is cut: the force is gone 50 ms after the patch's end, and comes back without a step") {
  SmallWorld world;
  world.link.delay = 30ms;
  auto& hand = world.add(1, "hand");
  world.run(2s);
  const auto& ticks = world.places[1].ticks;
  CHECK(ticks.back().force.norm() == Approx(1));
  const std::size_t cut = ticks.size();
  world.link.loss = 1;
  world.run(2500ms);
  const Micros valid = hand.last_patch().valid_for;
  for (std::size_t i = cut; i < ticks.size(); ++i)
    if (ticks[i].patch_age > valid + kFade) REQUIRE(ticks[i].force.norm() == 0);
  CHECK(ticks.back().force.norm() == 0);
  const std::size_t healed = ticks.size();
  world.link.loss = 0;
  world.run(1s);
  CHECK(ticks.back().force.norm() == Approx(1));
  CHECK(largest_step(ticks, cut) <= 1.0 / 50 + 1e-9);
  // The force is back within a round trip, two frames and the fade.
  const auto back = healed + 60 + 100 + 50;
  CHECK(ticks[back].force.norm() == Approx(1));
}

TEST_CASE("a patch that is renewed over a bad link is felt as if it came anew, for fewer patches") {
  struct Felt {
    int faded = 0;
    Micros oldest{};
    std::uint64_t patches = 0, renewed = 0;
  };
  const auto felt = [](double deadband) {
    SmallWorld world(ContactKind::touch, deadband);
    world.link = {60ms, 20ms, 0.05, 0.02};
    world.room.renews = deadband > 0;
    auto& hand = world.add(1, "hand", 1234567us);
    world.run(2s);
    const std::size_t from = world.places[1].ticks.size();
    world.run(10s);
    Felt f;
    for (std::size_t i = from; i < world.places[1].ticks.size(); ++i) {
      f.faded += world.places[1].ticks[i].gain < 1;
      f.oldest = std::max(f.oldest, world.places[1].ticks[i].patch_age);
    }
    f.patches = hand.haptic().counts().patches_used;
    f.renewed = hand.counts().renewed;
    CHECK(hand.link_report().patch_age <= 2 * 60ms + 50ms + 80ms);
    return f;
  };
  const Felt all = felt(0), renewed = felt(0.1);
  CHECK(all.faded == 0);
  CHECK(renewed.faded == 0);
  CHECK(renewed.oldest <= all.oldest + 50ms);
  CHECK(all.renewed == 0);
  CHECK(renewed.renewed > 100);
  CHECK(2 * renewed.patches < all.patches);
}

TEST_CASE("a patch that was renewed fades when the server falls silent, as late as one that came anew would") {
  SmallWorld world(ContactKind::touch, 0.1);
  world.link.delay = 20ms;
  world.room.renews = true;
  world.add(1, "hand");
  world.run(3s);
  const auto& ticks = world.places[1].ticks;
  REQUIRE(ticks.back().patch_age <= 100ms);
  world.server.reset();
  world.run(kServerSilenceLeast - 51ms);
  CHECK(ticks.back().gain == 1);
  world.run(20ms + 51ms + kFade + 1ms);
  CHECK(ticks.back().force.norm() == 0);
}
