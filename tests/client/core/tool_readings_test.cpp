// Orientation and buttons of a tool, from the haptic thread over a bad link to the server.
#include <algorithm>

#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("every change of the buttons reaches the server once, in order and at its moment, over a link that loses and repeats") {
  SmallWorld world;
  world.link = {20ms, 15ms, 0.2, 0.2};
  std::vector<ButtonChange> heard, said;
  world.server->on_buttons([&](StationId, const ButtonChange& change) { heard.push_back(change); });
  ClientCore& core = world.add(1, "hand", 77s);
  world.run(2s);
  std::uint32_t pressed = 0;
  for (int k = 0; k < 60; ++k) {
    pressed = pressed == 0 ? 1u << k % 32 : 0;
    const Micros t = world.clock(1);
    core.haptic().buttons().say(t, pressed);
    core.haptic().buttons().say(t + 1us, pressed);  // nothing new
    said.push_back({t - 77s, pressed});
    world.run(std::chrono::milliseconds(20 + 7 * (k % 20)));
  }
  world.run(500ms);
  REQUIRE(heard.size() == said.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    CHECK(heard[i].pressed == said[i].pressed);
    CHECK(std::chrono::abs(heard[i].t - said[i].t) < 40ms);  // accuracy of the server's clock estimate over this link
    CHECK((i == 0 || heard[i].t > heard[i - 1].t));
  }
}

TEST_CASE("the orientation at the server is the newest of the hand's, and nothing once the device has none") {
  SmallWorld world;
  world.add(1, "hand");
  world.run(500ms);
  const StationId id = world.server->stations().front().id;
  CHECK_FALSE(world.server->orientation(id));
  CHECK_FALSE(world.server->orientation(id + 1));
  const Rotation held(Eigen::Quaterniond(0.1, 0.2, -0.3, 0.9).normalized());
  world.places.at(1).turn = Rotation(Rotation::Identity());
  world.run(2ms);
  world.places.at(1).turn = held;
  world.run(20ms);
  REQUIRE(world.server->orientation(id));
  CHECK(world.server->orientation(id)->angularDistance(held) < 1e-4);
  world.places.at(1).turn = Rotation(NAN, 0, 0, 0);
  world.run(20ms);
  CHECK_FALSE(world.server->orientation(id));
}

TEST_CASE("a server that begins anew learns which buttons are pressed") {
  SmallWorld world;
  ClientCore& core = world.add(1, "hand");
  world.run(500ms);
  core.haptic().buttons().say(world.clock(1), 4);
  world.run(500ms);
  world.start_server(2);
  std::vector<ButtonChange> heard;
  world.server->on_buttons([&](StationId, const ButtonChange& change) { heard.push_back(change); });
  world.run(5s);
  REQUIRE(core.counts().joins == 2);
  REQUIRE(heard.size() == 1);
  CHECK(heard[0].pressed == 4);
}

TEST_CASE(
    "each sample of a tool with a body reaches the body with its orientation, over a link that loses, and of a point the last") {
  const bool body = GENERATE(true, false);
  SmallWorld world;
  if (body) world.tool = {ToolSphere{Vec3(0.01, 0, 0), 0.004}};
  world.start_server(2);
  world.link = {20ms, 5ms, 0.1, 0.1};
  ClientCore& core = world.add(1, "hand");
  world.run(500ms);
  REQUIRE(core.link() == LinkState::joined);
  CHECK(core.welcome().turns == body);
  world.room.jobs.clear();
  const auto turn_at = [](Micros t) { return Rotation(Eigen::AngleAxisd(3 * std::sin(seconds(t)), Vec3(1, 2, 2) / 3)); };
  for (int ms = 0; ms < 3000; ++ms) {
    world.places.at(1).turn = turn_at(world.now + 1ms);
    world.run(1ms);
  }
  std::size_t with = 0, all = 0;
  for (const FrameJob& job : world.room.jobs)
    for (const StationJob& station : job.stations)
      for (const ToolSample& sample : station.samples) {
        ++all;
        if (!sample.orientation) continue;
        ++with;
        CHECK(sample.orientation->angularDistance(turn_at(sample.t)) <
              0.02);  // the server's estimate of the clock is within 5 ms
      }
  REQUIRE(all > 2000);
  if (body) CHECK(10 * with > 9 * all);
  if (!body) CHECK(2 * with < all);
}

TEST_CASE("Each sample of a tool with jaws reaches the body with its opening, and an opening that is none as the nearest") {
  const bool jaws = GENERATE(true, false);
  SmallWorld world;
  world.tool = {ToolSphere{Vec3(0.01, 0, 0), 0.004, 0.03, jaws ? 0.4 : 0.0}};
  world.start_server(2);
  world.link = {20ms, 5ms, 0.1, 0.1};
  ClientCore& core = world.add(1, "hand");
  world.run(500ms);
  REQUIRE(core.link() == LinkState::joined);
  CHECK(core.welcome().jaws == jaws);
  world.room.jobs.clear();
  const Micros begin = world.now;
  const auto wanted = [](Micros t) { return 0.5 + 0.7 * std::sin(seconds(t)); };
  for (int ms = 0; ms < 3000; ++ms) {
    world.places.at(1).opening = ms == 700 ? std::nan("") : wanted(world.now + 1ms);
    world.run(1ms);
  }
  std::size_t all = 0;
  for (const FrameJob& job : world.room.jobs)
    for (const StationJob& station : job.stations)
      for (const ToolSample& sample : station.samples) {
        if (sample.t < begin + 10ms) continue;
        ++all;
        const double opening = jaws ? std::clamp(wanted(sample.t), 0.0, 1.0) : 0;
        CHECK(std::abs(sample.opening - opening) < 0.005);  // the server's estimate of the clock is within 5 ms
      }
  CHECK(all > 2000);
}
