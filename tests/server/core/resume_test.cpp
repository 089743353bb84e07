// A body that is resumed from a recording, and the tools that wait on it.
#include "server/record/resume.hpp"

#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "server/record/reserved_tools.hpp"
#include "server/record/room_recorder.hpp"
#include "server/room/room.hpp"
#include "server/scene/scene.hpp"
#include "server/scene/surface.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

Scene scene_named(const char* name) { return load_scene(std::string(PALPATE_SOURCE_DIR "/scenes/") + name); }

constexpr Micros kFrame = 50ms;

/// A room with a tool at rest, frame by frame, and its recorder; no network.
struct Pressed {
  Scene scene;
  Room room{scene};
  ReservedTools absent;
  Micros at = 10s;
  FrameResult last;

  explicit Pressed(Micros begin = 10s, Scene of = scene_named("touch-cube.json")) : scene(std::move(of)), at(begin) {
    room.start(begin);
  }
  /// `tool` is that of station 7; without it the station is absent.
  const FrameResult& frame(const std::optional<Vec3>& tool, bool reset = false) {
    FrameJob job;
    job.begin = at;
    job.target = at + kFrame;
    job.state = true;
    job.reset = reset;
    if (tool) {
      StationJob station;
      station.id = 7;
      station.scheme = Scheme::port;
      station.horizon = 100ms;
      station.samples = {{at, *tool}, {at + kFrame, *tool}};
      job.stations.push_back(station);
    }
    absent.add_to(job, here);
    last = room.run(job);
    absent.take_out(last);
    at += kFrame;
    return last;
  }
  std::vector<StationReport> here;
};

StationReport report(StationId id, const std::string& name) {
  StationReport station;
  station.id = id;
  station.name = name;
  return station;
}

/// Presses for `frames` frames, 8 mm into the top of the cube.
Vec3 press(Pressed& world, int frames) {
  const Vec3 above = home_of(world.scene), pressed = above - Vec3(0, 0, 0.028);
  for (int k = 0; k < frames; ++k) world.frame(above + std::min(1.0, k / 10.0) * (pressed - above));
  return pressed;
}

double farthest(const Vector& a, const Vector& b) { return (a - b).cwiseAbs().maxCoeff(); }

RecordingHead head_of(const Scene& scene) {
  RecordingHead head;
  head.name = "room";
  head.unix_time = Micros{1'800'000'000'000'000};
  head.clock_time = 9s;
  head.scene = "{}";
  head.surface = recorded_surface(scene);
  return head;
}

RecordedCheckpoint checkpoint_of(const FrameResult& result, std::vector<RecordedHold> holds) {
  RecordedCheckpoint checkpoint{result.stamp, {}, {}, std::move(holds)};
  for (std::uint32_t node = 0; node < result.state->x.size() / 3; ++node) {
    checkpoint.positions.emplace_back(at_node(result.state->x, node));
    checkpoint.velocities.emplace_back(at_node(result.state->v, node));
  }
  if (result.state->history) checkpoint.relaxed = side_by_side(*result.state->history);
  return checkpoint;
}

/// Resume point of a recording that ends now.
std::optional<ResumePoint> recorded(const Pressed& world, const Vec3& tool) {
  RecordingWriter writer(head_of(world.scene));
  writer.add(checkpoint_of(world.last, {{"hand", tool}}));
  writer.finish();
  const auto bytes = writer.take();
  return newest_checkpoint(RecordingReader(bytes, "old.rec"), "old.rec", "room", world.scene);
}

std::string error_of(const RecordingHead& head, const Scene& scene, const std::string& room = "room") {
  RecordingWriter writer(head);
  const auto bytes = writer.take();
  try {
    newest_checkpoint(RecordingReader(bytes, "old.rec"), "old.rec", room, scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a body that is taken up again stays as it was while its tools wait, and until the hand has it", "[resume]") {
  Pressed before;
  const Vec3 tool = press(before, 60);
  REQUIRE(before.last.stations.front().contact);
  const double depth = farthest(before.last.state->x, Pressed().frame(std::nullopt).state->x);
  REQUIRE(depth > 0.005);
  const auto found = recorded(before, tool);
  REQUIRE(found);
  CHECK(found->unix_time == Micros{1'800'000'000'000'000} + (before.last.stamp - Micros(9s)));

  Pressed after(500s);
  after.room.resume(in_a_row(found->checkpoint.positions), in_a_row(found->checkpoint.velocities));
  after.absent = ReservedTools(found->checkpoint.holds);
  const Vector was = before.last.state->x;
  double most = 0;
  for (int k = 0; k < 80; ++k) most = std::max(most, farthest(after.frame(std::nullopt).state->x, was));
  CHECK(after.last.stations.empty());
  CHECK(after.absent.holds().size() == 1);
  // Friction under the tool may settle again: a fiftieth of the depth.
  CHECK(most < depth / 50);
  const Vec3 force = before.last.stations.front().force;
  after.here = {report(7, "hand")};
  for (int k = 0; k < 20; ++k) most = std::max(most, farthest(after.frame(tool).state->x, was));
  CHECK(after.absent.holds().empty());
  REQUIRE(after.last.stations.size() == 1);
  CHECK(most < depth / 50);
  CHECK((after.last.stations.front().force - force).norm() < 0.05 * force.norm());
}

TEST_CASE("a body whose stress has faded remembers that when it is taken up again", "[resume]") {
  const auto fading = [] {
    return read_scene(R"({"body": {"lattice": {"nodes": [4, 4, 4], "size_m": [0.06, 0.06, 0.06], "fixed_faces": ["z-"],
        "solid": {"young_pa": 8000, "relaxation": [{"share": 0.3, "time_s": 0.3}, {"share": 0.3, "time_s": 20}]}}},
        "tool": {"contact": "touch", "radius_m": 0.02}})",
                      "fading.json");
  };
  Pressed before(10s, fading());
  const Vec3 tool = press(before, 60);
  const double force = before.last.stations.front().force.norm();
  REQUIRE(before.last.stations.front().contact);
  const auto found = recorded(before, tool);
  REQUIRE(found);
  const double went_on = before.frame(tool).stations.front().force.norm();
  const auto goes_on = [&](const Eigen::MatrixXf& relaxed, bool taken) {
    Pressed after(500s, fading());
    const RecordedCheckpoint& was = found->checkpoint;
    CHECK(after.room.resume(in_a_row(was.positions), in_a_row(was.velocities), relaxed) == taken);
    return after.frame(tool).stations.front().force.norm();
  };
  CHECK(goes_on(found->checkpoint.relaxed, true) == Approx(went_on).epsilon(0.01));
  CHECK(went_on == Approx(force).epsilon(0.01));
  CHECK(goes_on(found->checkpoint.relaxed.leftCols(3), false) > 1.1 * force);
}

TEST_CASE("a tool whose station does not come back lets go after ten seconds, and at a reset at once", "[resume]") {
  Pressed before;
  const Vec3 tool = press(before, 60);
  const Vector rest = Pressed().frame(std::nullopt).state->x;
  for (const bool reset : {false, true}) {
    Pressed after(500s);
    after.room.resume(before.last.state->x, before.last.state->v);
    after.absent = ReservedTools({{"hand", tool}});
    after.here = {report(7, "another")};  // another station does not take it over
    const int frames = reset ? 5 : static_cast<int>(ReservedTools::kLongest / kFrame) - 1;
    for (int k = 0; k < frames; ++k) after.frame(std::nullopt);
    REQUIRE(farthest(after.last.state->x, rest) > 0.005);
    after.frame(std::nullopt, reset);
    CHECK(after.absent.holds().empty());
    for (int k = 0; k < 60; ++k) after.frame(std::nullopt);
    CHECK(farthest(after.last.state->x, rest) < 1e-4);
  }
}

TEST_CASE("a recording of another room, body or machine is refused in words, one without a checkpoint is not", "[resume]") {
  const Scene cube = scene_named("touch-cube.json");
  const RecordingHead head = head_of(cube);
  CHECK(error_of(head, cube).empty());
  RecordingWriter writer(head);
  const auto bytes = writer.take();
  CHECK_FALSE(newest_checkpoint(RecordingReader(bytes, "old.rec"), "old.rec", "room", cube));
  CHECK(error_of(head, cube, "liver") == "old.rec: is of room \"room\"; expected of room \"liver\"");
  RecordingHead station = head;
  station.kind = RecordingKind::station;
  CHECK_THAT(error_of(station, cube), Catch::Contains("old.rec: is a station's recording; expected one of a room"));
  RecordingHead other = head;
  ++other.surface.mesh_hash;
  CHECK_THAT(error_of(other, cube), Catch::Contains("is of a body with another surface; expected that of scene"));
  other = head;
  ++other.surface.body_vertices;
  CHECK_THAT(error_of(other, cube), Catch::Contains("vertices; expected the "));
}

TEST_CASE("viewers and recordings have the surface of a cut body, with its walls marked", "[cuts]") {
  const Scene scene = scene_named("cuts/dissection.json");
  const RoomInfo facts = facts_of(scene, Vec3::Zero());
  CHECK(facts.nodes == scene.body.nodes.size());
  CHECK(check_edges(facts.mesh.triangles).closed());
  const auto walls = std::ranges::count_if(facts.mesh.vertices, &MeshVertex::wall);
  CHECK(walls > 0);

  RecordingHead head = head_of(scene);
  CHECK(head.surface.body_nodes == scene.body.nodes.size());
  CHECK(head.surface.body_vertices == scene.body.vertices());
  CHECK(std::ssize(head.surface.walls) == walls);
  Room room(scene);
  FrameJob job;
  job.target = 50ms;
  job.shapes = job.state = true;
  room.start(Micros{});
  const FrameResult frame = room.run(job);
  REQUIRE(frame.positions.size() == scene.body.vertices());
  CHECK(frame.state->x.size() == 3 * std::ssize(scene.body.nodes));
  RecordingWriter writer(head);
  writer.add_shape(frame.stamp, frame.positions);
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "cut.rec");
  CHECK(recording.damage().empty());
  CHECK(recording.head().surface.walls == head.surface.walls);
}

TEST_CASE("a checkpoint that does not fit its own head is refused", "[resume]") {
  const Scene cube = scene_named("touch-cube.json");
  RecordingWriter writer(head_of(cube));
  writer.add(RecordedCheckpoint{10s, {Vec3::Zero()}, {Vec3::Zero()}, {}});
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "old.rec");
  CHECK_THROWS_WITH(newest_checkpoint(recording, "old.rec", "room", cube), Catch::Contains("its newest checkpoint has 1 nodes"));
}
