// Selection of the stations whose patches have time, by FrameBudget alone.
#include "server/core/frame_budget.hpp"

#include <catch2/catch.hpp>

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// Stations of scheme `hyper` in contact, the last `shadows` of them shadows of the first; a step takes 5 ms.
struct Served {
  Stations stations;
  FrameBudget detail{20};
  Micros now{10s}, patch;
  std::map<StationId, int> times;

  Served(StationId hands, StationId shadows, Micros patch_took) : patch(patch_took) {
    for (StationId id = 1; id <= hands + shadows; ++id) {
      Station& station = stations[id];
      station.id = id;
      station.hello.station = "s" + std::to_string(id);
      station.hello.scheme = Scheme::hyper;
      if (id > hands) station.hello.shadow_of = "s1";
    }
  }
  void frames(int count) {
    for (; count > 0; --count, now += 50ms) {
      detail.choose(stations, now);
      FrameResult result;
      result.stamp = now;
      result.step_took = 5ms;
      for (auto& [id, station] : stations) {
        station.touched = now;
        if (!station.served) continue;
        ++times[id];
        StationFrame frame;
        frame.id = id;
        frame.patch.emplace();
        frame.patch->scheme = Scheme::hyper;
        result.stations.push_back(std::move(frame));
        result.patches_took += patch;
      }
      detail.learn(result, stations, 50ms);
    }
  }
};

}  // namespace

TEST_CASE("As long as the patches of all fit into a frame all are served in each") {
  Served served(4, 0, 10ms);
  served.frames(100);
  for (const auto& [id, times] : served.times) CHECK(times == 100);
}

TEST_CASE("Where they do not the first hand is served in each frame and the others in turn") {
  Served served(6, 0, 16ms);
  served.frames(10);
  served.times.clear();
  served.frames(100);
  CHECK(served.times[1] == 100);
  for (StationId id = 2; id <= 6; ++id) CHECK(served.times[id] == 20);
}

TEST_CASE("Hands that came first are served before shadows, as far as half of the time goes") {
  Served served(2, 8, 10ms);
  served.frames(10);
  served.times.clear();
  served.frames(80);
  CHECK(served.times[1] == 80);
  CHECK(served.times[2] == 80);
  for (StationId id = 3; id <= 10; ++id) CHECK(served.times[id] == 20);
}

TEST_CASE("Expected costs decide from the first frame on, until three frames have been measured") {
  const auto first_scheme = [](Micros nonlinear) {
    Served served(1, 0, 10ms);
    served.stations[1].hello.scheme.reset();
    served.detail.expect({5ms, 5ms, nonlinear, 5ms});
    served.frames(1);
    CHECK(served.stations[1].in_use.reason == (nonlinear > 40ms ? SchemeReason::server_busy : SchemeReason::fits));
    return served.stations[1].in_use.scheme;
  };
  CHECK(first_scheme(60ms) == Scheme::port);
  CHECK(first_scheme(20ms) == Scheme::hyper);
  Served served(2, 0, 24ms);
  served.detail.expect({5ms, 1ms, 1ms, 1ms});  // too little
  served.frames(1);
  CHECK(served.times[2] == 1);
  served.frames(9);
  served.times.clear();
  served.frames(100);
  CHECK(served.times[1] == 100);
  CHECK(served.times[2] < 100);
}

TEST_CASE("A patch that never fits beside the first hand's comes now and then, at a twentieth of the time") {
  Served served(2, 0, 30ms);
  served.frames(10);
  served.times.clear();
  served.frames(120);
  CHECK(served.times[1] == 120);
  CHECK(served.times[2] == 10);
}
