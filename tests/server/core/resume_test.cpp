// A body that is resumed from a recording, and the tools that wait on it.
#include "server/record/resume.hpp"

#include <Eigen/Geometry>

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

/// A room with one tool, frame by frame, and the tools that wait in it; no network.
struct OneTool {
  Scene scene;
  Room room{scene};
  ReservedTools absent;
  Micros at;
  FrameResult last;
  std::vector<StationReport> here;
  Scheme scheme = Scheme::hold;
  Orientation turn = {};
  bool shapes = false;

  OneTool(Micros begin, Scene of) : scene(std::move(of)), at(begin) { room.start(begin); }
  /// `tool` is that of station 7; without it the station is absent.
  const FrameResult& frame(const std::optional<Vec3>& tool, bool reset = false) {
    FrameJob job;
    job.begin = at;
    job.target = at + kFrame;
    job.state = true;
    job.shapes = shapes;
    job.reset = reset;
    if (tool) {
      StationJob station;
      station.id = 7;
      station.scheme = scheme;
      station.horizon = 100ms;
      station.samples = {{at, *tool, turn}, {at + kFrame, *tool, turn}};
      job.stations.push_back(station);
    }
    absent.add_to(job, here);
    last = room.run(job);
    absent.take_out(last);
    at += kFrame;
    return last;
  }
};

/// The tool rests on the body.
struct Pressed : OneTool {
  explicit Pressed(Micros begin = 10s, Scene of = scene_named("touch-cube.json")) : OneTool(begin, std::move(of)) {
    scheme = Scheme::port;
  }
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
  checkpoint.threads = recorded_threads(*result.state);
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
  after.absent = ReservedTools(found->checkpoint.holds, after.scene);
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

TEST_CASE("a body with threads, which recordings draw, is taken up again with them", "[resume]") {
  Pressed world(10s, scene_named("cuts/stitches.json"));
  world.frame(std::nullopt);
  const std::optional<ResumePoint> point = recorded(world, Vec3::Zero());
  REQUIRE(point);
  REQUIRE(point->checkpoint.threads.size() == 3);
  const auto threads = threads_of(point->checkpoint.threads, world.scene.body);
  REQUIRE(threads);
  for (std::size_t k = 0; k < 3; ++k) CHECK(threads->threads[k].length_m == world.last.state->sutures->threads[k].length_m);
}

TEST_CASE("a tool whose station does not come back lets go after ten seconds, and at a reset at once", "[resume]") {
  Pressed before;
  const Vec3 tool = press(before, 60);
  const Vector rest = Pressed().frame(std::nullopt).state->x;
  for (const bool reset : {false, true}) {
    Pressed after(500s);
    after.room.resume(before.last.state->x, before.last.state->v);
    after.absent = ReservedTools({{"hand", tool}}, after.scene);
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
  CHECK(std::ranges::count(head.surface.marks, kWallMark) == walls);
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
  CHECK(recording.head().surface.marks == head.surface.marks);
}

namespace {

Scene blade_scene() {
  return read_scene(R"({"body": {"lattice": {"nodes": [7, 7, 5], "size_m": [0.06, 0.06, 0.04], "fixed_faces": ["z-"],
      "solid": {"element": "hexahedron", "young_pa": 20000, "poisson": 0.45, "damping_s": 0.02}},
      "tissue": [{"toughness_j_m2": 20, "puncture_n": 0.3, "friction_n_m": 4}]},
      "tool": {"contact": "touch", "radius_m": 0.02, "blade": {"length_m": 0.036, "width_m": 0.04}}})",
                    "block.json");
}

/// A hand with a blade, its edge along y.
struct Cutting : OneTool {
  explicit Cutting(Micros begin) : OneTool(begin, blade_scene()) {
    turn = Rotation(Eigen::AngleAxisd(1.5707963267948966, Vec3::UnitZ()));
    shapes = true;
  }
  static Vec3 deep(double depth_m) { return {0.0312, 0.029, 0.04 - depth_m}; }
  void stab(double deepest_m) {
    for (double depth_m = -0.001; depth_m < deepest_m; depth_m += 0.0005) frame(deep(depth_m));
  }
  RecordedCheckpoint checkpoint() const {
    const StationFrame& hand = last.stations.front();
    RecordedCheckpoint made = checkpoint_of(last, {{"hand", hand.tool, hand.turn, 0, hand.needle}});
    made.cuts = recorded_cuts(*last.cuts);
    return made;
  }
};

std::optional<ResumePoint> written(const Scene& scene, const RecordedCheckpoint& checkpoint) {
  RecordingWriter writer(head_of(scene));
  writer.add(checkpoint);
  writer.finish();
  const auto bytes = writer.take();
  return newest_checkpoint(RecordingReader(bytes, "old.rec"), "old.rec", "room", scene);
}

}  // namespace

TEST_CASE("a body that a blade has cut is taken up again with its cuts, and the blade in it goes on where it was",
          "[resume][blade]") {
  Cutting before(10s);
  before.stab(0.024);
  REQUIRE(before.last.cuts);
  const StationFrame& hand = before.last.stations.front();
  REQUIRE(hand.needle);
  const double front_m = hand.needle->tip.front_m;
  REQUIRE(front_m > 0.012);
  const auto found = written(before.scene, before.checkpoint());
  REQUIRE(found);
  const RecordedCheckpoint& was = found->checkpoint;
  REQUIRE(was.positions.size() > before.scene.body.nodes.size());

  Cutting after(500s);
  CHECK(after.room.resume(in_a_row(was.positions), in_a_row(was.velocities), was.relaxed, steps_of(was.cuts)));
  after.absent = ReservedTools(was.holds, after.scene);
  for (int k = 0; k < 20; ++k) after.frame(std::nullopt);
  REQUIRE(after.last.cuts);
  CHECK(after.last.cuts->size() == before.last.cuts->size());
  REQUIRE(after.last.surface);
  CHECK(after.last.surface->triangles.size() == before.last.surface->triangles.size());
  const Vec3 tool = Cutting::deep(0.0235);
  for (int k = 0; k < 20; ++k) before.frame(tool);
  after.here = {report(7, "hand")};
  for (int k = 0; k < 20; ++k) after.frame(tool);
  REQUIRE(after.last.stations.size() == 1);
  const StationFrame &now = after.last.stations.front(), &went_on = before.last.stations.front();
  REQUIRE(now.needle);
  CHECK(now.needle->tip.front_m == Approx(front_m).margin(3e-4));
  // The friction of the shaft, 4 N/m over 23 mm, begins anew.
  CHECK(now.force.norm() == Approx(went_on.force.norm()).margin(4 * 0.0235 + 0.02));
  CHECK(farthest(after.last.state->x, before.last.state->x) < 5e-4);

  // It cuts on from there: as deep as if nothing had been.
  for (double depth_m = 0.0235; depth_m < 0.030; depth_m += 0.0005) {
    before.frame(Cutting::deep(depth_m));
    after.frame(Cutting::deep(depth_m));
  }
  CHECK(after.last.stations.front().needle->tip.front_m > front_m + 0.003);
  CHECK(after.last.state->x.size() == before.last.state->x.size());
  CHECK(after.last.stations.front().needle->tip.front_m == Approx(before.last.stations.front().needle->tip.front_m).margin(3e-4));

  after.frame(std::nullopt, true);
  CHECK_FALSE(after.last.cuts);
  CHECK(after.last.state->x.size() == 3 * std::ssize(after.scene.body.nodes));
}

TEST_CASE("a body that has torn is taken up again as it was torn, and tears on", "[resume][tears]") {
  OneTool before(10s, scene_named("cuts/tear.json"));
  before.shapes = true;
  const Vec3 grasped = home_of(before.scene);
  const auto lifted = [&](int k) { return Vec3(grasped + 0.00075 * k * Vec3(0.3, 0, 1)); };
  int k = 0;
  while (!before.last.cuts) {
    REQUIRE(k < 200);
    before.frame(lifted(k++));
  }
  for (int i = 0; i < 10; ++i) before.frame(lifted(k));
  RecordedCheckpoint made =
      checkpoint_of(before.last, {{"hand", before.last.stations.front().tool, Rotation::Identity(), 0, {}}});
  made.cuts = recorded_cuts(*before.last.cuts);
  const auto found = written(before.scene, made);
  REQUIRE(found);
  const RecordedCheckpoint& was = found->checkpoint;
  REQUIRE(was.positions.size() > before.scene.body.nodes.size());

  OneTool after(500s, before.scene);
  after.shapes = true;
  CHECK(after.room.resume(in_a_row(was.positions), in_a_row(was.velocities), was.relaxed, steps_of(was.cuts)));
  after.absent = ReservedTools(was.holds, after.scene);
  after.here = {report(7, "hand")};
  after.frame(lifted(k));
  REQUIRE(after.last.surface);
  CHECK(after.last.surface->triangles.size() == before.last.surface->triangles.size());
  for (int i = 0; i < 40; ++i, ++k) before.frame(lifted(k)), after.frame(lifted(k));
  CHECK(before.last.cuts->size() > made.cuts.size());
  REQUIRE(after.last.cuts->size() == before.last.cuts->size());
  CHECK(farthest(after.last.state->x, before.last.state->x) < 5e-4);
  after.frame(std::nullopt, true);
  CHECK_FALSE(after.last.cuts);
}

TEST_CASE("the cells of a body that is cut again from its steps have the bits of the one that was cut", "[resume][blade]") {
  Cutting before(10s);
  before.stab(0.026);
  REQUIRE(before.last.cuts);
  REQUIRE(std::ranges::count_if(*before.last.cuts, &CutStep::parts) > 1);
  const auto cuts = written(before.scene, before.checkpoint())->checkpoint.cuts;
  CutBody again(before.scene.body), stepwise(before.scene.body);
  const CutChange change = again.repeat(steps_of(cuts));
  for (const CutStep& step : *before.last.cuts) {
    stepwise.set(step.cut, step.to);
    if (step.parts) stepwise.part();
  }
  REQUIRE(again.body().hexahedra.size() == stepwise.body().hexahedra.size());
  for (std::size_t k = 0; k < again.body().hexahedra.size(); ++k) {
    CHECK(again.body().hexahedra[k].nodes == stepwise.body().hexahedra[k].nodes);
    CHECK(again.body().hexahedra[k].share == stepwise.body().hexahedra[k].share);
  }
  REQUIRE(3 * std::ssize(again.body().nodes) == before.last.state->x.size());
  for (std::size_t i = 0; i < change.node_before.size(); ++i)
    CHECK(again.body().nodes[i] == before.scene.body.nodes[change.node_before[i]]);
}

TEST_CASE("a checkpoint whose cuts do not fit the scene is refused", "[resume][blade]") {
  Cutting before(10s);
  before.stab(0.024);
  RecordedCheckpoint checkpoint = before.checkpoint();
  const auto refusal = [&](const Scene& scene, const RecordedCheckpoint& given) -> std::string {
    try {
      written(scene, given);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  CHECK(refusal(before.scene, checkpoint).empty());
  Scene without = before.scene;
  without.tool.needle.reset();
  CHECK_THAT(refusal(without, checkpoint),
             Catch::Contains("of a body that a blade has cut, or that has torn; expected a scene with"));
  RecordedCheckpoint wrong = checkpoint;
  wrong.cuts.clear();
  CHECK_THAT(refusal(before.scene, wrong), Catch::Contains("nodes; expected the 245 of its scene"));
  wrong = checkpoint;
  wrong.positions.pop_back();
  wrong.velocities.pop_back();
  CHECK_THAT(refusal(before.scene, wrong), Catch::Contains("of its scene with its cuts"));
  wrong = checkpoint;
  for (RecordedCut& cut : wrong.cuts) cut.number += 2;
  CHECK_THAT(refusal(before.scene, wrong), Catch::Contains("lacks a cut"));
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

TEST_CASE("a tool that waits on a resumed body is the one that its hand held", "[resume]") {
  Scene scene = scene_named("touch-cube.json");
  scene.tools = {{.name = "ball"}};
  FrameJob job;
  job.begin = 1s;
  job.target = 1s + kFrame;
  RecordedHold ball{"hand", Vec3(0, 0, 0.1)}, gone = ball;
  ball.held = "ball";
  gone.held = "shaft";
  ReservedTools({ball, {"other", Vec3::Zero()}, gone}, scene).add_to(job, {});
  REQUIRE(job.stations.size() == 2);  // this scene has no shaft
  CHECK(job.stations[0].held == 1);
  CHECK(job.stations[1].held == 0);
}
