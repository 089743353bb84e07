#include "server/room/nodal_fields.hpp"

#include <catch2/catch.hpp>

#include "server/room/room.hpp"

using namespace palpate;

namespace {

/// Three nodes in a row, springs of 100 N/m and 50 N/m.
LumpedBody row() {
  LumpedBody body;
  body.nodes = {Vec3(0, 0, 0), Vec3(0.1, 0, 0), Vec3(0.2, 0, 0)};
  body.elements = {{0, 1, 0.1, 100, 0.5}, {1, 2, 0.1, 50, 0.5}};
  return body;
}

}  // namespace

TEST_CASE("tension at a node is the largest force of its elements, pulled or pushed") {
  Vector x(9);
  x << 0, 0, 0, 0.11, 0, 0, 0.19, 0, 0;  // +10 mm, -20 mm
  const auto tension = element_tension(row(), x);
  REQUIRE(tension.size() == 3);
  CHECK(tension[0] == Approx(1.0));
  CHECK(tension[1] == Approx(1.0));
  CHECK(tension[2] == Approx(1.0));
  x[6] = 0.16;  // -50 mm
  const auto more = element_tension(row(), x);
  CHECK(more[0] == Approx(1.0));
  CHECK(more[1] == Approx(2.5));
  CHECK(more[2] == Approx(2.5));
}

TEST_CASE("a room says tension and support only when asked, and support where its patch has vertices") {
  const Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/touch-cube.json");
  Room room(scene);
  room.start(Micros{0});
  const Vec3 home = home_of(scene);
  FrameJob job;
  job.shapes = true;
  StationJob station;
  station.id = 1;
  station.horizon = Micros{100'000};
  FrameResult result;
  for (int frame = 1; frame <= 10; ++frame) {
    job.target = Micros{50'000 * frame};
    station.samples.clear();
    for (Micros t = job.target - Micros{49'000}; t <= job.target; t += Micros{1'000})
      station.samples.push_back({t, home - Vec3(0, 0, 0.05 * seconds(t))});
    job.stations = {station};
    job.tension = job.support = frame > 5;
    result = room.run(job);
    if (frame <= 5) CHECK((result.tension.empty() && result.support.empty()));
  }
  REQUIRE(result.tension.size() == scene.body.nodes.size());
  REQUIRE(result.support.size() == scene.body.nodes.size());
  REQUIRE(result.stations[0].patch);
  const auto& patch = *result.stations[0].patch;
  const auto carried = std::count_if(result.support.begin(), result.support.end(), [](float s) { return s > 0; });
  CHECK(carried == patch.surface.vertex_count);
  CHECK(*std::max_element(result.support.begin(), result.support.end()) == 1);
  if (result.stations[0].contact) CHECK(*std::max_element(result.tension.begin(), result.tension.end()) > 0);
}
