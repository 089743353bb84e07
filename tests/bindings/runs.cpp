// Runs in C++ whose numbers other languages repeat: doubles, as they are in memory, into FOLDER/{frame,played,felt,together}.f64.
//
// usage: bindings_runs SCENE FOLDER [press]      press: only frame and played
#include <cstdio>
#include <fstream>
#include <string_view>

#include "bench/fidelity/replay.hpp"
#include "bench/measure/examination.hpp"
#include "common/player/player.hpp"
#include "server/body/unload.hpp"
#include "server/room/room.hpp"

namespace palpate {
namespace {

class Numbers {
 public:
  explicit Numbers(const std::string& file) : out_(file, std::ios::binary) {}
  void add(const Vec3& v) { out_.write(reinterpret_cast<const char*>(v.data()), 3 * sizeof(double)); }

 private:
  std::ofstream out_;
};

/// Two frames of 50 ms in which a hand goes down by 30 mm, and 100 ms of the last patch.
void press(const Scene& scene, const std::string& folder) {
  const Vec3 home = home_of(scene);
  const auto at = [&](int ms) -> Vec3 { return home - Vec3(0, 0, 0.0003 * ms); };
  Room room(scene);
  room.start(Micros{0});
  Numbers frame_numbers(folder + "/frame.f64"), played(folder + "/played.f64");
  StationFrame last;
  for (int frame = 0; frame < 2; ++frame) {
    FrameJob job;
    job.begin = Micros{50'000 * frame};
    job.target = Micros{50'000 * (frame + 1)};
    job.shapes = true;
    StationJob station{.id = 1, .scheme = Scheme::hyper, .horizon = Micros{150'000}, .samples = {}};
    if (frame == 0) station.samples.push_back({Micros{0}, at(1)});
    for (int ms = 50 * frame + 1; ms <= 50 * (frame + 1); ++ms) station.samples.push_back({Micros{1'000 * ms}, at(ms)});
    job.stations = {station};
    const FrameResult result = room.run(job);
    for (const Vec3& node : result.positions) frame_numbers.add(node);
    frame_numbers.add(result.stations.at(0).force);
    last = result.stations.at(0);
  }
  PatchPlayer player(last.patch.value(), last.terms);
  for (int ms = 101; ms <= 200; ++ms) played.add(player.advance({Micros{1'000 * ms}, at(ms)}).force);
}

ReplayOptions options() {
  ReplayOptions o;
  o.scheme = Scheme::hyper;
  o.link.latency = Micros{75'000};
  o.link.jitter = Micros{10'000};
  o.link.loss = 0.03;
  o.link.seed = o.seed = 7;
  return o;
}

void felt(const ReplayResult& result, Numbers& numbers) {
  for (const ReplayTick& tick : result.ticks) {
    numbers.add(tick.felt);
    numbers.add(tick.reference);
  }
}

/// The press of an examination and half of its stroke.
Motion beginning(const Motion& motion) {
  std::vector<MotionPoint> points(motion.points().begin(), motion.points().end());
  std::erase_if(points, [](const MotionPoint& point) { return point.t_s > 2; });
  return Motion(std::move(points));
}

void replays(const Scene& scene, const std::string& folder) {
  const Motion motion = beginning(examination(scene));
  const Stopwatch no_time = [] { return std::int64_t{0}; };
  Numbers one(folder + "/felt.f64"), two(folder + "/together.f64");
  felt(replay(scene, motion, options(), no_time), one);
  const std::vector<Motion> both(2, motion);
  for (const ReplayResult& result : replay_together(scene, both, options(), no_time)) felt(result, two);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  const bool press_alone = argc == 4 && std::string_view(argv[3]) == "press";
  if (argc != 3 && !press_alone) return 2;
  const palpate::Scene scene = palpate::open_scene(argv[1]);
  palpate::press(scene, argv[2]);
  if (!press_alone) palpate::replays(scene, argv[2]);
}
