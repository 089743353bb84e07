// Recordings read back as written.
#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "common/base/error.hpp"
#include "tests/common/record/small_recording.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr double kStepM = 0x1p-27;

}  // namespace

TEST_CASE("a recording says what it is of, and keeps the surface's vertices alone", "[record]") {
  const auto bytes = small_recording(30, true);
  const RecordingReader recording(bytes, "small");
  CHECK(recording.complete());
  CHECK(recording.damage().empty());
  CHECK(recording.head().program == "test 1");
  CHECK(recording.head().name == "room");
  CHECK(recording.head().unix_time == Micros{1'800'000'000'000'000});
  CHECK(recording.head().clock_time == Micros{5'000'000});
  CHECK(recording.head().rate_hz == 20);
  CHECK(recording.head().shapes_hz == 10);
  CHECK(recording.head().scene == "{\"name\": \"pyramid\"}");
  CHECK(recording.head().task == small_head().task);
  REQUIRE(recording.head().parts.size() == 1);
  const PartMesh& part = recording.head().parts[0];
  CHECK(part.name == "roof");
  CHECK(part.colour == 0xff8000);
  CHECK(part.friction == 0.25);
  CHECK(part.mesh.triangles == std::vector<Triangle>{{0, 1, 2}});
  REQUIRE(part.mesh.vertices.size() == 3);
  CHECK(part.mesh.vertices[1].rest == Vec3(0.25, 0, 0.5));
  REQUIRE(recording.head().bodies.size() == 2);
  CHECK(recording.head().bodies[1].name == "peak");
  CHECK(recording.head().bodies[0].colour == 0x102030);
  const RecordedSurface& surface = recording.head().surface;
  CHECK(surface.marks == small_head().surface.marks);
  CHECK(surface.body_vertices == 5);
  CHECK(surface.mesh_hash == 77);
  CHECK(surface.nodes == std::vector<std::uint32_t>{0, 2, 3, 4});
  CHECK(surface.triangles.back() == Triangle{1, 2, 3});
  REQUIRE(recording.stations().size() == 1);
  CHECK(recording.name_of(3) == "hand");
  CHECK(recording.name_of(9) == "station 9");
}

TEST_CASE("every item comes back in order, in its numbers' resolution", "[record]") {
  constexpr int kFrames = 30;
  const auto bytes = small_recording(kFrames, true);
  const RecordingReader recording(bytes, "small");
  CHECK(recording.begin() == kSmallBegin - Micros{49'000});
  CHECK(recording.end() == kSmallBegin + (kFrames - 1) * kSmallFrame);
  int frame = 0;
  std::size_t samples = 0;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    REQUIRE(block);
    REQUIRE(block->frames.size() == block->touches.size());
    for (std::size_t i = 0; i < block->frames.size(); ++i, ++frame) {
      const RecordedTouch expected = small_touch(frame), &touch = block->touches[i];
      CHECK(block->frames[i].t == expected.t);
      CHECK(block->frames[i].took == Micros{4000});
      CHECK(block->frames[i].newton_iterations == 12);
      CHECK((touch.tool - expected.tool).cwiseAbs().maxCoeff() <= kStepM / 2);
      CHECK(touch.force == expected.force);
      CHECK(touch.torque == expected.torque);
      CHECK(touch.contact == expected.contact);
      CHECK(touch.scheme == Scheme::port);
      CHECK(touch.states == 16);
      CHECK(touch.horizon == Micros{120'000});
      CHECK(block->ticks[i].force == Vec3(0, 0, 1.5));
      const bool turned = frame % 3 == 0;
      CHECK(block->ticks[i].torque == (turned ? Vec3(0.125, 0, 0.5 * frame) : Vec3(Vec3::Zero())));
      CHECK(block->ticks[i].model_torque == (turned ? Vec3(0.25, 0, 0) : Vec3(Vec3::Zero())));
      CHECK(block->ticks[i].patch_age == Micros{70'000});
      CHECK(block->hand_overs[i].stamp == expected.t - Micros{70'000});
      CHECK(block->hand_overs[i].step_n == 0.125);
      CHECK(block->packets[i].bytes.size() == 10 + static_cast<std::size_t>(frame));
      CHECK(block->links[i].offset == Micros{-1234});
      CHECK(block->links[i].received == 100u + static_cast<unsigned>(frame));
    }
    for (const RecordedPath& path : block->paths) {
      samples += path.samples.size();
      for (const ToolSample& s : path.samples) CHECK(std::abs(s.position.x() - 0.2 * seconds(s.t - kSmallBegin)) <= kStepM / 2);
    }
  }
  CHECK(frame == kFrames);
  CHECK(samples == 50 * kFrames);
}

TEST_CASE("shapes are right to a step of the box that they lie in, and found by time", "[record]") {
  const auto bytes = small_recording(30, true);
  RecordingReader recording(bytes, "small");
  CHECK_FALSE(recording.shape_at(kSmallBegin - Micros{1}));
  for (const int k : {0, 7, 29, 8, 8}) {
    const Micros t = kSmallBegin + k * kSmallFrame;
    for (const Micros later : {Micros{0}, Micros{49'999}}) {
      const auto shape = recording.shape_at(t + later);
      REQUIRE(shape);
      CHECK(shape->t == t);
      const auto expected = small_shape(k);
      for (std::size_t i = 0; i < shape->positions.size(); ++i) {
        const std::uint32_t node = recording.head().surface.nodes[i];
        CHECK((shape->positions[i] - expected[node]).cwiseAbs().maxCoeff() <= 0.5 * 0.1 / 65535 + kStepM);
      }
    }
  }
}

TEST_CASE("of a body without triangles every vertex is recorded, of a station's recording none", "[record]") {
  RecordingHead head = small_head();
  head.surface = recorded_surface(small_shape(0), {}, 5);
  RecordingWriter sheet(head);
  sheet.add_shape(Micros{1}, small_shape(4));
  sheet.finish();
  const auto bytes = sheet.take();
  RecordingReader recording(bytes, "sheet");
  CHECK(recording.head().surface.nodes == std::vector<std::uint32_t>{0, 1, 2, 3, 4});
  const auto shape = recording.shape_at(Micros{1});
  REQUIRE(shape);
  CHECK((shape->positions[4] - small_shape(4)[4]).norm() < 2e-6);

  head.surface = {};
  RecordingWriter station(head);
  station.add_shape(Micros{1}, small_shape(4));
  station.add(RecordedTick{});
  station.finish();
  const auto no_shapes = station.take();
  RecordingReader without(no_shapes, "station");
  CHECK_FALSE(without.shape_at(Micros{1}));
  CHECK(without.tools_at(Micros{1}).size() == 1);
}

TEST_CASE("a shape that did not change is written once a block", "[record]") {
  RecordingWriter writer(small_head());
  for (int k = 0; k < 100; ++k) {
    const Micros t = k * Micros{20'000};
    writer.add(RecordedFrame{t, {}, {}, 0, 1, 0, 1, false});
    writer.add_shape(t, small_shape(0));
    writer.tick(t);
  }
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "still");
  REQUIRE(recording.blocks().size() == 5);
  for (std::size_t k = 0; k < 5; ++k) CHECK(recording.read(k)->shapes.size() == 1);
}

TEST_CASE("tools are found by time, and are gone with their station", "[record]") {
  RecordingWriter writer(small_head());
  for (int k = 0; k < 20; ++k) {
    add_small_frame(writer, k);
    writer.tick(small_touch(k).t);
  }
  const Micros alone = small_touch(20).t;
  writer.add(RecordedFrame{alone, {}, {}, 0, 1, 0, 1, false});
  writer.finish();
  const auto bytes = writer.take();
  RecordingReader recording(bytes, "tools");
  const auto tools = recording.tools_at(small_touch(11).t + Micros{20'000});
  REQUIRE_FALSE(tools.empty());
  const auto& touch = tools.back();
  CHECK(touch.station == 3);
  CHECK((touch.position - small_touch(11).tool).norm() < 1e-7);
  CHECK(touch.force == small_touch(11).force);
  CHECK(touch.contact);
  for (const RecordedTool& tool : recording.tools_at(alone)) CHECK(tool.station != 3);
}

TEST_CASE("a number that no recording can hold is recorded as 0 and said to be", "[record]") {
  RecordingWriter writer(small_head());
  RecordedTick tick;
  tick.position = Vec3(0, std::numeric_limits<double>::quiet_NaN(), 0);
  tick.force = Vec3(1, 2, 3);
  writer.add(tick);
  tick.position = Vec3(0, 11, 0);
  writer.add(tick);
  tick.position = Vec3(0, 1, 0);
  writer.add(tick);
  writer.add_shape(Micros{}, std::vector<Vec3>(5, Vec3::Constant(std::numeric_limits<double>::infinity())));
  writer.finish();
  const auto bytes = writer.take();
  const auto block = RecordingReader(bytes, "broken").read(0);
  REQUIRE(block);
  REQUIRE(block->ticks.size() == 3);
  CHECK(block->ticks[0].broken);
  CHECK(block->ticks[0].position == Vec3::Zero());
  CHECK(block->ticks[0].force == Vec3(1, 2, 3));
  CHECK(block->ticks[1].broken);
  CHECK_FALSE(block->ticks[2].broken);
  CHECK(block->shapes.empty());
}

TEST_CASE("a writer gives its bytes block by block, at least twice a second", "[record]") {
  RecordingWriter writer(small_head());
  std::size_t length = writer.take().size();
  CHECK(length > 0);
  Micros waited{};
  for (int k = 0; k < 100; ++k) {
    add_small_frame(writer, k);
    const auto bytes = writer.take();
    length += bytes.size();
    waited = bytes.empty() ? waited + kSmallFrame : Micros{};
    CHECK(waited <= Micros{500'000});
    CHECK(writer.bytes() == length);
  }
}

TEST_CASE("times far apart do not share a block", "[record]") {
  RecordingWriter writer(small_head());
  writer.add(RecordedFrame{Micros{0}, {}, {}, 0, 1, 0, 1, false});
  writer.add(RecordedFrame{Micros{5'000'000'000'000}, {}, {}, 0, 1, 0, 1, false});
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "far");
  REQUIRE(recording.blocks().size() == 2);
  CHECK(recording.read(1)->frames.front().t == Micros{5'000'000'000'000});
  CHECK(recording.block_at(Micros{4'999'999'999'999}) == 0);
  CHECK(recording.block_at(Micros{5'000'000'000'000}) == 1);
}

TEST_CASE("how tools are held and their buttons come back, and each block says them anew until the tool has left", "[record]") {
  RecordingWriter writer(small_head());
  const Eigen::Quaterniond held = Eigen::Quaterniond(0.2, 0.4, -0.4, 0.8).normalized();
  writer.add(RecordedEvent{kSmallBegin, RecordedEventKind::joined, 3, RecordedRole::hand, Scheme::port, "hand", ""});
  writer.add(RecordedTurn{kSmallBegin, 3, held, 0.4});
  writer.add(RecordedButtons{kSmallBegin + Micros{1234}, 3, 5});
  for (int k = 0; k < 40; ++k) {
    const Micros t = small_touch(k).t;
    if (k == 30) writer.add(RecordedEvent{t, RecordedEventKind::left, 3, RecordedRole::hand, Scheme::port, "hand", ""});
    writer.add(RecordedFrame{t, Micros{4000}, Micros{60'000}, 0, 5, 1, 12, false});
    if (k < 30) writer.add(small_touch(k));
    writer.tick(t);
  }
  writer.finish();
  const auto bytes = writer.take();
  RecordingReader recording(bytes, "small");
  REQUIRE(recording.blocks().size() > 3);
  const auto first = recording.read(0), second = recording.read(1), last = recording.read(recording.blocks().size() - 1);
  REQUIRE(first->buttons.size() == 1);
  CHECK(first->buttons[0].t == kSmallBegin + Micros{1234});
  CHECK(first->buttons[0].station == 3);
  CHECK(first->buttons[0].pressed == 5);
  REQUIRE(second->turns.size() == 1);
  CHECK(second->turns[0].orientation.angularDistance(held) < 1e-4);
  CHECK(second->turns[0].orientation.norm() == Approx(1).epsilon(1e-12));
  CHECK(second->turns[0].opening == Approx(0.4).margin(1e-5));
  REQUIRE(second->buttons.size() == 1);
  CHECK(second->buttons[0].pressed == 5);
  CHECK(last->turns.empty());
  CHECK(last->buttons.empty());
  const auto tools = recording.tools_at(second->frames.back().t);
  const auto pen = std::find_if(tools.begin(), tools.end(), [](const RecordedTool& tool) { return tool.station == 3; });
  REQUIRE(pen != tools.end());
  CHECK(pen->buttons == 5);
  CHECK(pen->orientation->angularDistance(held) < 1e-4);
  CHECK(pen->opening == Approx(0.4).margin(1e-5));
}

TEST_CASE("who guided whom, and with what forces, comes back", "[record]") {
  const auto bytes = small_recording(20, true);
  RecordingReader recording(bytes, "small");
  int k = 0;
  for (std::size_t number = 0; number < recording.blocks().size(); ++number) {
    const auto block = recording.read(number);
    for (const RecordedGuidance& hold : block->guidances) {
      CHECK(hold.t == kSmallBegin + k * kSmallFrame);
      CHECK(hold.guide == 3);
      CHECK(hold.guided == 4);
      CHECK(hold.guide_force_n == 0.25);
      CHECK(hold.guided_force_n == 0.5 * k);
      ++k;
    }
  }
  CHECK(k == 20);
}

TEST_CASE("what was written about a moment comes back with that moment and with its own time", "[record]") {
  const auto bytes = small_recording(20, true);
  RecordingReader recording(bytes, "small");
  CHECK(recording.begin() == kSmallBegin - kSmallFrame + Micros{1000});  // a note about a moment before it lengthens nothing
  std::vector<RecordedNote> notes;
  for (std::size_t number = 0; number < recording.blocks().size(); ++number) {
    const auto block = recording.read(number);
    notes.insert(notes.end(), block->notes.begin(), block->notes.end());
  }
  REQUIRE(notes.size() == 2);
  CHECK(notes[0].t == kSmallBegin + 5 * kSmallFrame);
  CHECK(notes[0].about == notes[0].t - Micros{30'000'000});
  CHECK(notes[0].station == 9);
  CHECK(notes[0].author == "Weber");
  CHECK(notes[0].text == "too deep");
  CHECK(notes[1].text.empty());
}

TEST_CASE("a recording's end does not grow with every station that comes and goes, and what came is in its blocks", "[record]") {
  constexpr StationId kMany = 50'000;
  RecordingWriter writer(small_head());
  RecordedEvent event;
  event.kind = RecordedEventKind::joined;
  event.name = "somebody who comes and goes";
  std::size_t last = 0;
  for (StationId id = 1; id <= kMany; ++id) {
    event.t = kSmallBegin + Micros{id};
    event.station = id;
    writer.add(event);
    writer.tick(event.t);
    last = std::max(last, writer.take().size());
  }
  writer.finish();
  CHECK(writer.take().size() < last + 500'000);
}

TEST_CASE("a checkpoint has every vertex to a step of the wire and its velocity, and one that cannot be carried is left out",
          "[record]") {
  RecordingWriter writer(test::small_head());
  const std::vector<Vec3> x{{0, 0, 0}, {0.05, 0.0123456789, 0.02}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.09}};
  const std::vector<Vec3> v(5, Vec3(0.1, -0.2, 0.3));
  RecordedHold right{"right", Vec3::Zero()};
  right.held = "probe";
  writer.add(RecordedCheckpoint{Micros{2'000'000}, x, v, {{"left hand", Vec3(0.01, 0.02, 0.0901)}, right}});
  std::vector<Vec3> torn = x;
  torn[2].y() = std::numeric_limits<double>::quiet_NaN();
  writer.add(RecordedCheckpoint{Micros{2'100'000}, torn, v, {}});
  writer.add(RecordedCheckpoint{Micros{2'200'000}, x, torn, {}});
  const Eigen::MatrixXf relaxed = 2 * Eigen::MatrixXf::Random(6, 40);
  writer.add(RecordedCheckpoint{Micros{2'300'000}, x, v, {}, relaxed});
  Eigen::MatrixXf wrong = relaxed;
  wrong(3, 7) = std::numeric_limits<float>::infinity();
  writer.add(RecordedCheckpoint{Micros{2'400'000}, x, v, {}, wrong});
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "checkpoint.rec");
  REQUIRE(recording.blocks().size() == 1);
  const auto block = recording.read(0);
  REQUIRE(block);
  REQUIRE(block->checkpoints.size() == 2);
  CHECK(block->checkpoints[0].relaxed.size() == 0);
  REQUIRE(block->checkpoints[1].relaxed.rows() == 6);
  REQUIRE(block->checkpoints[1].relaxed.cols() == 40);
  CHECK((block->checkpoints[1].relaxed - relaxed).cwiseAbs().maxCoeff() < 2.0 / 32767);
  const RecordedCheckpoint& found = block->checkpoints.front();
  CHECK(found.t == Micros{2'000'000});
  REQUIRE(found.positions.size() == x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    CHECK((found.positions[k] - x[k]).cwiseAbs().maxCoeff() <= std::ldexp(0.5, -27));
    CHECK((found.velocities[k] - v[k]).norm() < 1e-7);
  }
  REQUIRE(found.holds.size() == 2);
  CHECK(found.holds[0].station == "left hand");
  CHECK((found.holds[0].tool - Vec3(0.01, 0.02, 0.0901)).norm() < 1e-7);
  CHECK(found.holds[0].held.empty());
  CHECK(found.holds[1].held == "probe");
}

TEST_CASE("which tool a hand holds comes back with its join, its shape too, and the first of the scene is not said", "[record]") {
  const ToolShape shape{{Vec3(0, 0, 64 * kToolStepM), 32 * kToolStepM, 3000 * kToolStepM, 4000 * kSwingStepRad},
                        {Vec3::Zero(), 32 * kToolStepM}};
  RecordingWriter writer(small_head());
  RecordedEvent joined{kSmallBegin, RecordedEventKind::joined, 3, RecordedRole::hand, Scheme::port, "left", ""};
  writer.add(joined);
  joined.station = 4;
  joined.name = "right";
  joined.tool = {"grasper", shape};
  writer.add(joined);
  joined.station = 5;
  joined.tool = {"point", {}};
  writer.add(joined);
  writer.finish();
  const auto bytes = writer.take();
  const RecordingReader recording(bytes, "tools");
  const auto block = recording.read(0);
  REQUIRE(block);
  REQUIRE(block->events.size() == 3);
  CHECK(block->events[0].tool == HeldTool{});
  CHECK(block->events[1].tool == HeldTool{"grasper", shape});
  CHECK(block->events[2].tool == HeldTool{"point", {}});
  REQUIRE(recording.stations().size() == 3);
  CHECK(recording.stations()[1].tool == "grasper");
}
