// Training tasks of the scenes that ship: good trainees score high, bad ones low, by what a recording of them holds.
#include "common/assessment/task_attempts.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <functional>

#include "common/record/writer.hpp"
#include "server/record/room_recorder.hpp"
#include "server/room/room.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;

namespace {

constexpr Micros kBegin{1'000'000}, kAttemptTick{1'000}, kFrame{50'000};
constexpr StationId kHand = 1;

/// A trainee: where the tool is at a time [s] after the start, given the force that it felt in the last frame.
struct Trainee {
  std::function<Vec3(double t_s, double force_n)> tool;
  double press_button_s = -1;  ///< for a tenth of a second
};

Scene scene_of(const char* name) {
  return load_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "scenes/tasks" / (std::string(name) + ".json"));
}

/// Records the trainee in a room, as the server does, and reads the attempt back.
TaskProgress score_of(const Scene& scene, const Trainee& trainee, double length_s) {
  RecordingHead head = test::small_head();
  head.surface = recorded_surface(scene);
  head.task = scene.task;
  RecordingWriter writer(head);
  writer.add(RecordedEvent{kBegin, RecordedEventKind::joined, kHand, RecordedRole::hand, Scheme::port, "anna", ""});
  Room room(scene);
  room.start(kBegin);
  double force_n = 0;
  bool down = false;
  for (Micros now = kBegin; now < kBegin + from_seconds(length_s);) {
    FrameJob job;
    job.begin = now;
    job.target = now + kFrame;
    job.frame = kFrame;
    job.rollouts = false;
    StationJob hand;
    hand.id = kHand;
    hand.wants_patch = false;
    for (Micros t = now + kAttemptTick; t <= job.target; t += kAttemptTick)
      hand.samples.push_back({t, trainee.tool(seconds(t - kBegin), force_n)});
    job.stations.push_back(std::move(hand));
    const double t_s = seconds(job.target - kBegin);
    const bool press = t_s >= trainee.press_button_s && t_s < trainee.press_button_s + 0.1 && trainee.press_button_s >= 0;
    if (press != down) writer.add(RecordedButtons{job.target, kHand, press ? 1u : 0u});
    down = press;
    const FrameResult result = room.run(job);
    now = job.target;
    REQUIRE(result.stations.size() == 1);
    REQUIRE_FALSE(result.failed);
    RecordedTouch touch;
    touch.t = result.stamp;
    touch.station = kHand;
    touch.tool = result.stations[0].tool;
    touch.force = result.stations[0].force;
    touch.contact = result.stations[0].contact;
    writer.add(touch);
    force_n = touch.force.norm();
  }
  writer.finish();
  const std::vector<std::byte> bytes = writer.take();
  const RecordingReader recording(bytes, "test");
  const std::vector<TaskAttempt> attempts = task_attempts(recording);
  REQUIRE(attempts.size() == 1);
  CHECK(attempts[0].station == "anna");
  CHECK(attempts[0].number == 1);
  return attempts[0].progress;
}

/// Along the line at a speed, pressed in by a depth, shifted aside along the surface.
Vec3 along(const TraceTask& trace, double arc_m, double depth_m, double aside_m) {
  for (std::size_t i = 1; i < trace.line.size(); ++i) {
    const LinePoint &a = trace.line[i - 1], &b = trace.line[i];
    const double step_m = (b.at - a.at).norm();
    if (arc_m <= step_m || i + 1 == trace.line.size()) {
      const double share = std::min(arc_m / step_m, 1.0);
      const Vec3 normal = ((1 - share) * a.normal + share * b.normal).normalized();
      const Vec3 across = normal.cross(b.at - a.at).normalized();
      return a.at + share * (b.at - a.at) - depth_m * normal + aside_m * across;
    }
    arc_m -= step_m;
  }
  return trace.line.back().at;
}

/// Hovers, then presses in at a place within a second.
Vec3 onto(const Vec3& place, const Vec3& normal, double t_s, double depth_m) {
  const double s = std::min(t_s, 1.0);
  return place + (0.01 - s * (0.01 + depth_m)) * normal;
}

}  // namespace

TEST_CASE("who holds the force scores high in scenes/tasks/press.json, who presses too hard or trembles low", "[task]") {
  const Scene scene = scene_of("press");
  const Vec3 home = home_of(scene);
  double depth_m = 0;
  const Trainee careful{[&](double t_s, double force_n) {
    if (t_s < 0.001) depth_m = 0;
    depth_m += (force_n < 0.05 ? 0.02 : 0.012 * (1 - force_n)) * 1e-3;
    return Vec3(home - depth_m * Vec3::UnitZ());
  }};
  CHECK(score_of(scene, careful, 9).score == 100);
  const Trainee rough{[&](double t_s, double) { return Vec3(home - std::min(0.03 * t_s, 0.045) * Vec3::UnitZ()); }};
  CHECK(score_of(scene, rough, 9).score < 20);
  const Trainee trembling{[&](double t_s, double) {
    return Vec3(home - (std::min(0.03 * t_s, 0.025) + 0.01 * std::sin(2 * 3.14159 * t_s)) * Vec3::UnitZ());
  }};
  CHECK(score_of(scene, trembling, 9).score < 30);
}

TEST_CASE("who follows the line scores high in scenes/tasks/trace.json, who cuts it or strays low", "[task]") {
  const Scene scene = scene_of("trace");
  const auto& trace = std::get<TraceTask>(scene.task->goal);
  const double length_m = length_of(trace);
  const auto strays = [&](auto aside_m) {
    return Trainee{[&trace, aside_m](double t_s, double) {
      return along(trace, std::max(0.0, 0.02 * (t_s - 0.5)), std::min(0.006, 0.012 * t_s), aside_m(t_s));
    }};
  };
  const double time_s = length_m / 0.02 + 1;
  const TaskProgress good = score_of(scene, strays([](double) { return 0.0; }), time_s);
  CHECK(good.score > 90);
  CHECK(good.finished());
  CHECK(score_of(scene, strays([](double t_s) { return 0.008 * std::sin(2 * t_s); }), time_s).score < 50);
  CHECK(score_of(scene, strays([](double) { return 0.004; }), time_s).score == 0);
  const LinePoint &from = trace.line.front(), &to = trace.line.back();
  const Trainee cuts{[&](double t_s, double) {
    const double share = std::clamp(t_s / time_s, 0.0, 1.0);
    return Vec3(from.at + share * (to.at - from.at) - 0.006 * from.normal);
  }};
  CHECK(score_of(scene, cuts, time_s).score < 50);
}

TEST_CASE("who marks the lump scores high in scenes/tasks/find.json, who marks another place low", "[task]") {
  const Scene scene = scene_of("find");
  const auto& find = std::get<FindTask>(scene.task->goal);
  const Vec3 normal = (find.above - find.lump).normalized();
  const auto marks = [&](const Vec3& place) {
    return Trainee{[&find, normal, place](double t_s, double) { return onto(place, normal, t_s, 0.008); }, 1.5};
  };
  const Vec3 aside = normal.cross(Vec3::UnitX()).normalized();
  CHECK(score_of(scene, marks(find.above), 2).score > 90);
  CHECK(score_of(scene, marks(find.above + 0.006 * aside), 2).score > 90);
  CHECK(score_of(scene, marks(find.above + 0.03 * aside), 2).score < 20);
  Trainee unsure = marks(find.above);
  unsure.press_button_s = -1;
  CHECK(score_of(scene, unsure, 2).score == 0);
}

TEST_CASE("a reset of the body begins a new attempt, and a hand that comes back continues its own", "[task]") {
  RecordingWriter writer(test::small_head());  // hold 0.5 to 2 N for 3 s
  const auto touch = [&](StationId id, int frame, double force_n) {
    RecordedTouch t;
    t.t = kBegin + frame * kFrame;
    t.station = id;
    t.force = Vec3(0, 0, force_n);
    t.contact = force_n > 0;
    writer.add(t);
  };
  for (const StationId id : {1u, 2u, 3u})
    writer.add(
        RecordedEvent{kBegin, RecordedEventKind::joined, id, RecordedRole::hand, Scheme::port, id == 2 ? "bert" : "anna", ""});
  for (int k = 0; k <= 20; ++k) {
    touch(1, k, 1);
    touch(2, k, 0);
  }
  writer.add(RecordedEvent{kBegin + 25 * kFrame, RecordedEventKind::reset, 2, RecordedRole::hand, Scheme::port, "bert", ""});
  for (int k = 30; k <= 40; ++k) {
    touch(1, k, 1);
    touch(2, k, 1);
  }
  for (int k = 41; k <= 50; ++k) touch(3, k, 1);
  writer.finish();
  const auto bytes = writer.take();
  const std::vector<TaskAttempt> attempts = task_attempts(RecordingReader(bytes, "test"));
  REQUIRE(attempts.size() == 3);
  CHECK(attempts[0].station == "anna");
  CHECK(attempts[0].progress.held_s == Approx(1));
  CHECK(attempts[1].station == "anna");
  CHECK(attempts[1].number == 2);
  CHECK(attempts[1].progress.held_s == Approx(1));
  CHECK(attempts[2].station == "bert");
  CHECK(attempts[2].number == 1);
  CHECK(attempts[2].progress.score == Approx(100 * 0.5 / 3));
}

TEST_CASE("a mark is where the tool was after the button, also where its frame was written in a later block", "[task]") {
  const Scene scene = scene_of("find");
  RecordingHead head = test::small_head();
  head.surface = recorded_surface(scene);
  head.task = scene.task;
  RecordingWriter writer(head);
  const auto touch_at = [&](int frame) {
    RecordedTouch touch;
    touch.t = kBegin + frame * kFrame;
    touch.station = kHand;
    touch.tool = home_of(scene) + Vec3(0, 0, -0.001 * frame);
    touch.contact = true;
    writer.add(touch);
  };
  writer.add(RecordedEvent{kBegin, RecordedEventKind::joined, kHand, RecordedRole::hand, Scheme::port, "anna", ""});
  touch_at(1);
  writer.add(RecordedButtons{kBegin + 5 * kFrame / 2, kHand, 1u});
  writer.tick(kBegin);
  writer.tick(kBegin + RecordingWriter::kBlock);
  touch_at(2);
  touch_at(3);
  writer.finish();
  const std::vector<std::byte> bytes = writer.take();
  const RecordingReader recording(bytes, "test");
  REQUIRE(recording.blocks().size() == 2);
  const std::vector<TaskAttempt> attempts = task_attempts(recording);
  REQUIRE(attempts.size() == 1);
  REQUIRE(attempts[0].progress.mark);
  CHECK((*attempts[0].progress.mark - home_of(scene) - Vec3(0, 0, -0.003)).norm() < 1e-6);
}
