// The frames of one world for its twin: reused only for identical jobs.
#include <catch2/catch.hpp>

#include "bench/world/attacked.hpp"

using namespace palpate;

namespace {

constexpr Micros kFrame{50'000};

/// A hand that pushes a node sideways; frame k of it.
FrameJob push(int k, double further_m = 0) {
  FrameJob job;
  job.begin = k * kFrame;
  job.target = job.begin + kFrame;
  job.frame = kFrame;
  job.shapes = true;
  StationJob station;
  station.id = 1;
  station.horizon = kFrame;
  for (int i = 0; i <= 1; ++i) station.samples.push_back({job.begin + i * kFrame, Vec3(0.001 * (k + i) + i * further_m, 0, 0)});
  job.stations = {station};
  return job;
}

struct Pushed {
  Scene scene = load_scene(std::string(PALPATE_SOURCE_DIR) + "/scenes/cube6.json");
  Room room{scene};
  Pushed() { room.start(Micros{}); }
  /// Runs job k, with its tool relative to the grasped node.
  std::vector<Vec3> run(const FrameRunner& runner, FrameJob job) {
    for (ToolSample& sample : job.stations[0].samples) sample.position += home_of(scene);
    return runner(room, job).positions;
  }
};

}  // namespace

TEST_CASE("frames that are asked for again are taken, and from the first other one on the body goes on from where it would be") {
  constexpr int kSame = 3, kAll = 6;
  FrameLog log;
  Pushed first, twin, alone;
  const FrameRunner real = [](Room&room, const FrameJob&job) { return room.run(job); }, record = log.recorder(),
                    play = log.player();
  std::vector<std::vector<Vec3>> seen;
  for (int k = 0; k < kAll; ++k) seen.push_back(first.run(record, push(k)));
  CHECK(log.frames() == kAll);
  for (int k = 0; k < kAll; ++k) {
    const FrameJob job = push(k, k == kSame ? 1e-9 : 0);
    const auto by_twin = twin.run(play, job), by_itself = alone.run(real, job);
    INFO("frame " << k);
    CHECK(by_twin == by_itself);
    CHECK((by_twin == seen[static_cast<std::size_t>(k)]) == (k < kSame));
  }
  CHECK(log.taken() == kSame);
}

TEST_CASE("whatever a room is asked for otherwise is another frame") {
  const FrameJob job = push(1);
  std::vector<FrameJob> others(9, job);
  others[0].begin += Micros{1};
  others[1].stations[0].samples[1].position.z() = -1e-300;
  others[2].stations[0].samples[0].t += Micros{1};
  others[3].stations[0].playing = Micros{};
  others[4].stations[0].deadband = 1e-300;
  others[5].stations.clear();
  others[6].reset = true;
  others[7].stations[0].wants_patch = false;
  others[8].state = true;
  for (const FrameJob& other : others) CHECK(hash_of(other) != hash_of(job));
  CHECK(hash_of(push(1)) == hash_of(job));
}

TEST_CASE("a world whose frames are taken from its twin gives the bits of one that computes them") {
  DrawOptions draw;
  draw.seed = 3;
  draw.duration_s = 1.2;
  draw.faults = draw.losses = false;
  const Scenario scenario = draw_scenario(draw);
  FrameLog log;
  RunOptions record, play;
  record.run_frame = log.recorder();
  const AttackedRun real = run_with_keys(scenario, Attacker::none, Manner::careful, record);
  play.run_frame = log.player();
  const AttackedRun taken = run_with_keys(scenario, Attacker::none, Manner::careful, play);
  CHECK_FALSE(first_difference(real.report, taken.report));
  CHECK(log.frames() > 20);
  CHECK(log.taken() == log.frames());
}
