// Faults of the participants of the simulated world.
#include <catch2/catch.hpp>

#include "bench/world/world.hpp"
#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

Scene cube6() { return load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cube6.json"); }

/// One hand that holds the node 3 mm off, with 10 ms each way.
struct SmallWorld {
  Scene scene = cube6();
  World world{scene, {}};
  WorldStation* station = nullptr;
  TickOutput last;
  Micros ticked{};
  int ticks = 0;

  explicit SmallWorld(double drift_ppm = 0) {
    ClientOptions options;
    options.hello.station = "hand";
    LinkSpec link;
    link.latency = Micros{10'000};
    const Vec3 place = home_of(scene) + Vec3(0.003, 0, 0);
    station = &world.add_station(options, std::make_unique<ReplayDevice>(Motion::rest(place, 60)), link, link, drift_ppm);
    station->on_tick = [this](Micros now, const Vec3&, const TickOutput& out) {
      last = out;
      ticked = now;
      ++ticks;
    };
  }
  void until_ms(int t) { world.run_until(Micros{1000 * t}); }
};

}  // namespace

TEST_CASE("A clock with drift reads what it says, steps ahead, and is inverted to the microsecond") {
  for (const double ppm : {-100.0, 0.0, 73.5}) {
    WorldClock clock(Micros{5'000'000}, ppm);
    CHECK(clock.at(Micros{10'000'000}).count() == Approx(15e6 + 10 * ppm).margin(1));
    clock.step(Micros{250'000});
    for (const int t : {0, 1, 999, 1'000'000, 12'345'678})
      CHECK(clock.at(clock.world(clock.at(Micros{t}))) == clock.at(Micros{t}));
  }
}

TEST_CASE("The haptic thread ticks on the milliseconds of its own clock") {
  SmallWorld fast(1e4);  // 1 %, clearly visible
  fast.until_ms(1000);
  CHECK(fast.ticks == Approx(1010).margin(2));
  CHECK(fast.station->clock(fast.ticked).count() % 1000 == Approx(0).margin(1));
}

TEST_CASE("A cut link brings no newer patch, and a patch again when it is mended") {
  SmallWorld w;
  w.until_ms(1000);
  REQUIRE(w.last.patch_age < Micros{150'000});
  SECTION("both ways") { w.station->cut(true, true); }
  SECTION("towards the station") { w.station->cut(false, true); }
  w.until_ms(2400);
  CHECK(w.last.patch_age >= Micros{1'200'000});
  CHECK(w.last.force.norm() == 0);  // long past its validity
  w.station->cut(false, false);
  w.until_ms(2800);
  CHECK(w.last.patch_age < Micros{150'000});
  CHECK(w.last.force.norm() > 0.05);
}

TEST_CASE("A server that stalls takes and says nothing, then goes on with who was there") {
  SmallWorld w;
  w.until_ms(1000);
  const auto frames = w.world.server().counts().frames;
  w.world.stall_server(true);
  w.until_ms(1600);
  CHECK(w.world.server().counts().frames == frames);
  CHECK(w.last.patch_age >= Micros{600'000});
  w.world.stall_server(false);
  w.until_ms(2200);
  CHECK(w.last.patch_age < Micros{150'000});
  CHECK(w.station->core().counts().joins == 1);
}

TEST_CASE("A server that died is found again in its next life, with the body at rest or as it was") {
  for (const bool keep : {false, true}) {
    SmallWorld w;
    w.until_ms(1000);
    w.world.kill_server();
    w.until_ms(1500);
    w.world.start_server(keep);
    w.until_ms(2800);
    CHECK(w.station->core().counts().joins == 2);
    CHECK(w.last.patch_age < Micros{150'000});
    CHECK(w.last.force.norm() > 0.05);
  }
}

TEST_CASE("A station that crashed comes back under its name once the server has missed it, one that left at once") {
  SmallWorld crashed, left;
  for (SmallWorld* w : {&crashed, &left}) w->until_ms(1000);
  crashed.station->crash();
  left.station->leave();
  for (SmallWorld* w : {&crashed, &left}) {
    w->until_ms(1100);
    CHECK_FALSE(w->station->up());
    const int ticks = w->ticks;
    w->until_ms(1200);
    CHECK(w->ticks == ticks);
    w->station->join_again(w->world.now());
    w->until_ms(1500);
  }
  CHECK(left.station->core().link() == LinkState::joined);
  CHECK(crashed.station->core().link() == LinkState::refused);
  crashed.until_ms(3500);
  CHECK(crashed.station->core().link() == LinkState::joined);
  CHECK(crashed.last.force.norm() > 0.05);
}

TEST_CASE("A network thread that stalls delays no haptic tick, and what waited for it is taken afterwards") {
  SmallWorld w;
  w.until_ms(1000);
  const int ticks = w.ticks;
  w.station->stall_net(true);
  w.until_ms(1400);
  CHECK(w.ticks == ticks + 400);
  CHECK(w.last.patch_age >= Micros{400'000});
  w.station->stall_net(false);
  w.until_ms(1800);
  CHECK(w.last.patch_age < Micros{150'000});
  CHECK(w.station->core().haptic().counts().samples_dropped == 0);
}

TEST_CASE("A haptic thread that stalls skips its ticks and is never made to catch them up") {
  SmallWorld w;
  w.until_ms(1000);
  const int ticks = w.ticks;
  w.station->stall_haptic(true);
  w.until_ms(1100);
  CHECK(w.ticks == ticks);
  w.station->stall_haptic(false);
  w.until_ms(1200);
  CHECK(w.ticks == Approx(ticks + 100).margin(1));
}

TEST_CASE("A station whose clock steps ahead feels the body again within half a second") {
  for (const int step_ms : {50, 900, 5000}) {
    SmallWorld w;
    w.until_ms(1000);
    w.station->step_clock(Micros{1000 * step_ms});
    w.until_ms(1500);
    INFO(step_ms);
    CHECK(w.last.patch_age < Micros{150'000});
    CHECK(w.last.force.norm() > 0.05);
  }
}

TEST_CASE("A station whose machine was asleep goes on by itself when it wakes, however long that was") {
  for (const int asleep_ms : {20, 400, 2'000, 10'000}) {
    SmallWorld w;
    w.until_ms(1000);
    const Micros before = w.station->clock(w.world.now());
    const int ticks = w.ticks;
    w.station->sleep(w.world.now());
    w.until_ms(1000 + asleep_ms);
    CHECK(w.ticks == ticks);
    w.station->wake(w.world.now());
    CHECK(w.station->clock(w.world.now()) == before);
    w.until_ms(1000 + asleep_ms + 1500);
    INFO(asleep_ms << " ms");
    CHECK(w.ticks == ticks + 1500);
    CHECK(w.station->core().link() == LinkState::joined);
    CHECK(w.station->core().counts().joins == (asleep_ms < 3000 ? 1 : 2));
    CHECK(w.last.patch_age < Micros{150'000});
    CHECK(w.last.force.norm() > 0.05);
  }
}
