// A viewer and the real server core, in virtual time over a link with losses drawn from a seed.
#include <catch2/catch.hpp>
#include <random>

#include "client/viewer/recorded_scene.hpp"
#include "client/viewer/view_core.hpp"
#include "client/viewer/view_recorder.hpp"
#include "common/base/limits.hpp"
#include "server/core/server_core.hpp"
#include "tests/client/view/demo_body.hpp"

using namespace palpate;

namespace {

constexpr Micros kDelay{20'000};

struct InFlight {
  Micros at;
  std::vector<std::byte> bytes;
};

/// The body rises at 10 mm/s from the start of the server's clock.
std::vector<Vec3> lifted(const demo::Body& body, Micros stamp) {
  std::vector<Vec3> positions;
  for (const Vec3f& p : body.rest) positions.push_back(p.cast<double>() + Vec3(0, 0, 0.01 * seconds(stamp)));
  return positions;
}

PartMesh roof() { return {"roof", 0xff8000, 0.25, {{{Vec3(0, 0, 1)}, {Vec3(1, 0, 1)}, {Vec3(0, 1, 1)}}, {{0, 1, 2}}}}; }

RoomInfo roofed(const demo::Body& body) {
  RoomInfo facts = demo::facts_of(body);
  facts.parts = {roof()};
  return facts;
}

struct World {
  demo::Body body = demo::pressed_organ(0, 0, 3);
  ServerCore server{roofed(body), {.draw = repeatable(11), .rate_hz = 20}};
  ViewCore viewer{"watcher", Micros{0}};
  double loss = 0;
  std::mt19937 random{5};
  std::vector<InFlight> up, down;
  Micros now{0};

  bool lost() { return std::bernoulli_distribution(loss)(random); }

  template <class Take>
  void deliver(std::vector<InFlight>& line, const Take& take) {
    for (const InFlight& d : line)
      if (d.at <= now) take(d.bytes);
    std::erase_if(line, [this](const InFlight& d) { return d.at <= now; });
  }

  void step(bool server_runs = true) {
    std::array<std::byte, kMaxDatagramBytes> out;
    deliver(down, [this](const auto& bytes) { viewer.take(bytes, now); });
    viewer.tick(now);
    while (const auto size = viewer.emit(out, now)) {
      if (!lost()) up.push_back({now + kDelay, {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)}});
    }
    if (!server_runs) return up.clear();
    deliver(up, [this](const auto& bytes) { server.take(bytes, 1, now); });
    server.tick(now);
    if (const auto job = server.next_job(now)) {
      FrameResult result;
      result.stamp = job->target;
      if (job->shapes) result.positions = lifted(body, job->target);
      server.finish(std::move(result), now);
    }
    PeerId to = 0;
    while (const auto size = server.emit(out, to, now)) {
      if (to == 1 && !lost()) down.push_back({now + kDelay, {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size)}});
    }
  }

  void run_until(Micros end, bool server_runs = true) {
    for (; now < end; now += Micros{5'000}) step(server_runs);
  }
};

}  // namespace

TEST_CASE("A viewer joins, gets the topology and shows the moving body at the stated delay", "[view]") {
  World world;
  world.run_until(Micros{1'500'000});
  REQUIRE(world.viewer.link() == LinkState::joined);
  REQUIRE(world.viewer.welcome().scene == "demo");
  REQUIRE(world.viewer.ready());
  REQUIRE(world.viewer.mesh().triangles == world.body.triangles);
  ViewMoment moment;
  REQUIRE(world.viewer.show(world.now, moment));
  const double shown_s = seconds(world.now - kDelay - world.viewer.playback().delay());
  for (std::size_t i = 0; i < moment.shape.positions.size(); ++i) {
    REQUIRE((moment.shape.positions[i] - world.body.rest[i]).z() == Approx(0.01 * shown_s).margin(1e-4));
  }
}

TEST_CASE("A viewer says how late it shows the body, with the way there and the time to compute", "[view]") {
  World world;
  CHECK_FALSE(world.viewer.ready());
  world.run_until(Micros{2'500'000});
  ViewMoment moment;
  REQUIRE(world.viewer.show(world.now, moment));
  const Micros late = world.viewer.lateness(world.now);
  CHECK(seconds(late) == Approx(seconds(world.now - moment.shape.body_time)).margin(0.005));  // both clocks are the world's
  CHECK(late >= kDelay + world.viewer.playback().delay());
}

TEST_CASE("Notes arrive once each and in order over a link with losses, and a refusal ends the one that it answers", "[view]") {
  World world;
  world.loss = 0.3;
  bool recording = true;
  std::vector<RecordedNote> notes;
  world.server.on_note([&](const RecordedNote& note) {
    if (recording) notes.push_back(note);
    return recording;
  });
  CHECK_FALSE(world.viewer.write_note({0, world.now, "", "before it has joined"}));
  world.run_until(Micros{1'000'000});
  REQUIRE(world.viewer.link() == LinkState::joined);
  for (const char* text : {"one", "two", "three"}) REQUIRE(world.viewer.write_note({0, Micros{500'000}, "Weber", text}));
  world.run_until(Micros{5'000'000});
  REQUIRE(notes.size() == 3);
  CHECK(notes[0].text == "one");
  CHECK(notes[2].text == "three");
  CHECK(notes[2].about == Micros{500'000});
  auto outcomes = world.viewer.take_note_outcomes();
  REQUIRE(outcomes.size() == 3);
  for (const NoteOutcome& outcome : outcomes) CHECK(outcome.refusal.empty());
  CHECK(world.viewer.take_note_outcomes().empty());

  recording = false;
  for (const char* text : {"four", "five"}) REQUIRE(world.viewer.write_note({0, Micros{0}, "", text}));
  world.run_until(Micros{9'000'000});
  outcomes = world.viewer.take_note_outcomes();
  REQUIRE(outcomes.size() == 2);
  for (const NoteOutcome& outcome : outcomes) CHECK(outcome.refusal == "the room is not being recorded (--record)");
  REQUIRE(world.viewer.link() == LinkState::joined);
  recording = true;
  REQUIRE(world.viewer.write_note({0, Micros{0}, "", "six"}));
  world.run_until(Micros{12'000'000});
  CHECK(notes.size() == 4);

  for (std::size_t k = 0; k < ViewCore::kNotesMost; ++k) CHECK(world.viewer.write_note({0, Micros{0}, "", "never"}));
  CHECK_FALSE(world.viewer.write_note({0, Micros{0}, "", "one too many"}));
  world.run_until(Micros{17'000'000}, false);  // the server is silent
  for (const NoteOutcome& outcome : world.viewer.take_note_outcomes())
    if (outcome.note.text == "never") CHECK((outcome.refusal.empty() || outcome.refusal.find("ended") != std::string::npos));
}

TEST_CASE("With a fifth of all datagrams lost a viewer still gets there and keeps showing", "[view]") {
  World world;
  world.loss = 0.2;
  world.run_until(Micros{4'000'000});
  REQUIRE(world.viewer.ready());
  REQUIRE(world.viewer.mesh().triangles == world.body.triangles);
  ViewMoment moment;
  REQUIRE(world.viewer.show(world.now, moment));
  REQUIRE(moment.shape.positions[0].z() - world.viewer.rest()[0].z() > 0.015F);
  REQUIRE(world.viewer.shape_counts().healed > 0);
}

TEST_CASE("A viewer keeps the mesh of the same scene when the server restarts", "[view]") {
  World world;
  world.run_until(Micros{1'000'000});
  REQUIRE(world.viewer.ready());
  const auto version = world.viewer.mesh_version();
  world.server = ServerCore(demo::facts_of(world.body), {.draw = repeatable(12), .rate_hz = 20});
  world.run_until(Micros{2'500'000});
  REQUIRE(world.viewer.link() == LinkState::joined);
  REQUIRE(world.viewer.counts().joins == 2);
  REQUIRE(world.viewer.mesh_version() == version);
  ViewMoment moment;
  REQUIRE(world.viewer.show(world.now, moment));
}

TEST_CASE("What a viewer heard last holds while it hears the server, and no longer than half a second after", "[view]") {
  World world;
  world.run_until(Micros{2'000'000});
  CHECK(world.viewer.heard_lately(world.now));
  CHECK(world.viewer.shapes_lately(world.now) >= 19);
  CHECK(world.viewer.shapes_lately(world.now) <= 21);
  world.run_until(Micros{2'450'000}, false);
  CHECK(world.viewer.heard_lately(world.now));
  world.run_until(Micros{2'700'000}, false);
  CHECK_FALSE(world.viewer.heard_lately(world.now));
  CHECK(world.viewer.link() == LinkState::joined);
  CHECK(world.viewer.shapes_lately(world.now) < 10);
  world.run_until(Micros{3'200'000}, false);
  CHECK(world.viewer.shapes_lately(world.now) == 0);
}

TEST_CASE("A viewer learns that the server's machine is starved, and that it is not any more", "[view]") {
  World world;
  world.run_until(Micros{1'000'000});
  CHECK_FALSE(world.viewer.room().starved);
  world.server.set_starved(true);
  world.run_until(Micros{1'500'000});
  CHECK(world.viewer.room().starved);
  world.server.set_starved(false);
  world.run_until(Micros{2'000'000});
  CHECK_FALSE(world.viewer.room().starved);
}

TEST_CASE("What a viewer receives is recorded as it was shown, and plays", "[view][replay]") {
  World world;
  world.run_until(Micros{1'000'000});
  REQUIRE(world.viewer.ready());
  REQUIRE(world.viewer.has_parts());
  ViewRecorder recorder(world.viewer, "test 1", Micros{0});
  for (Micros end{1'020'000}; end <= Micros{3'000'000}; end += Micros{20'000}) {
    world.run_until(end);
    recorder.take(world.viewer, world.now);
  }
  recorder.finish();
  const auto bytes = recorder.bytes();
  const RecordingReader recording(bytes, "watched");
  REQUIRE(recording.complete());
  CHECK(recording.head().name == "demo");
  RecordedScene scene(recording, "watched");
  CHECK(scene.mesh().triangles == world.body.triangles);
  REQUIRE(scene.parts().size() == 1);
  CHECK(scene.parts()[0].name == "roof");
  CHECK(scene.parts()[0].mesh.triangles == roof().mesh.triangles);
  for (std::size_t v = 0; v < world.body.rest.size(); ++v)
    REQUIRE(scene.mesh().vertices[v].fixed == (world.body.rest[v].z() < 0.022F));
  CHECK(seconds(scene.end() - scene.begin()) > 1.9);
  for (const double share : {0.1, 0.5, 0.9}) {
    const Micros t = scene.begin() + from_seconds(share * seconds(scene.end() - scene.begin()));
    const ViewMoment moment = scene.at(t);
    for (std::size_t v = 0; v < world.body.rest.size(); ++v)
      REQUIRE((moment.shape.positions[v] - world.body.rest[v]).z() == Approx(0.01 * seconds(t)).margin(1e-4));
  }
}
