// A room's recording of stations with a core and a room without a body.
#include "server/record/room_recorder.hpp"

#include "common/record/reader.hpp"
#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

/// A bench whose core and frames are recorded.
struct RecordedBench {
  Bench bench;
  RoomRecorder recorder{head()};

  RecordedBench() {
    bench.core.on_event([this](const RecordedEvent& event) { recorder.event(event); });
  }
  static RecordingHead head() {
    RecordingHead head;
    head.rate_hz = 20;
    head.shapes_hz = 5;
    head.surface = recorded_surface(std::vector<Vec3>(400, Vec3::Zero()), {{0, 1, 2}, {2, 1, 399}}, 77);
    return head;
  }
  /// Does the work of the server's shell.
  void tick() {
    bench.core.tick(bench.now);
    if (auto job = bench.core.next_job(bench.now)) {
      recorder.begin_frame(*job, bench.now);
      const FrameResult result = bench.room.run(*job);
      recorder.end_frame(result, bench.core, bench.now);
      bench.core.finish(result, bench.now);
    }
    bench.collect();
    recorder.tick(bench.core, bench.now);
  }
  void live(RawStation& station, Micros time, std::vector<ToolSample>* said = nullptr) {
    for (const auto end = bench.now + time; bench.now < end;) {
      bench.now += 1ms;
      if (said) said->push_back(station.sample());
      station.say_samples({station.sample()});
      tick();
    }
  }
  std::vector<std::byte> finish() {
    recorder.finish();
    return recorder.take();
  }
};

}  // namespace

TEST_CASE("every sample that reached the body is recorded once, in the server's clock, with every frame, tool and patch",
          "[record]") {
  RecordedBench recorded;
  RawStation hand(recorded.bench, 1, "hand");
  hand.clock_offset = Micros{777'000'000};
  hand.join();
  std::vector<ToolSample> said;
  recorded.live(hand, 2s, &said);
  const auto bytes = recorded.finish();
  const RecordingReader recording(bytes, "bench");
  REQUIRE(recording.complete());
  std::vector<ToolSample> samples;
  std::size_t frames = 0, touches = 0, shapes = 0, links = 0, patch_bytes = 0;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    REQUIRE(block);
    for (const RecordedPath& path : block->paths) samples.insert(samples.end(), path.samples.begin(), path.samples.end());
    frames += block->frames.size();
    touches += block->touches.size();
    shapes += block->shapes.size();
    links += block->links.size();
    for (const RecordedTouch& touch : block->touches) {
      CHECK(touch.force == Vec3(0, 0, 1));
      CHECK(touch.has_patch);
      patch_bytes += touch.bytes;
    }
  }
  REQUIRE(samples.size() > 1900);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) REQUIRE(samples[i].t > samples[i - 1].t);
    const Micros before = samples[i].t - said.front().t + hand.clock_offset;
    const auto which = static_cast<std::size_t>((before.count() + 500) / 1000);
    REQUIRE((samples[i].position - said[which].position).norm() < 1e-6);
  }
  CHECK(frames == recorded.bench.core.counts().frames);
  const auto sent = recorded.bench.core.stations().front().counts;
  CHECK(2 * touches == sent.patches);  // each is sent twice to a hand that does not report its loss
  CHECK(2 * patch_bytes == sent.patch_bytes);
  CHECK(shapes >= 5);
  CHECK(links >= 7);
}

TEST_CASE("who comes, goes, falls silent or is refused is recorded with the reason", "[record]") {
  RecordedBench recorded;
  RawStation first(recorded.bench, 1, "first"), second(recorded.bench, 2, "second"), again(recorded.bench, 3, "first");
  first.join();
  second.hello.role = Role::viewer;
  second.join();
  CHECK(reason(again.ask()) == RefuseReason::name_taken);
  second.say(Leave{});
  for (int ms = 0; ms < 4000; ++ms) {
    recorded.bench.now += 1ms;
    recorded.tick();
  }
  const auto bytes = recorded.finish();
  const RecordingReader recording(bytes, "bench");
  std::vector<std::string> happened;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    REQUIRE(block);
    for (const RecordedEvent& event : block->events)
      happened.push_back(std::string(name_of(event.kind)) + " " + event.name + (event.text.empty() ? "" : ": " + event.text));
  }
  CHECK(happened == std::vector<std::string>{"joined first", "joined second",
                                             "refused first: station \"first\" is in the room already", "left second",
                                             "silent first"});
  REQUIRE(recording.stations().size() == 2);
  CHECK(recording.stations()[1].role == RecordedRole::viewer);
}

TEST_CASE("shapes are asked for at their own rate, and at no other frame", "[record]") {
  RecordedBench recorded;
  RawStation hand(recorded.bench, 1, "hand");
  hand.join();
  recorded.live(hand, 4s);
  const auto asked = std::count_if(recorded.bench.room.jobs.begin(), recorded.bench.room.jobs.end(),
                                   [](const FrameJob& job) { return job.shapes; });
  CHECK(asked >= 19);
  CHECK(asked <= 21);
}

TEST_CASE("checkpoints come once a second, of a large body as often as 96 kB a second allow", "[record]") {
  struct Body {
    std::uint32_t nodes;
    double every_s;
  };
  for (const Body& body : {Body{400, 1.0}, Body{4'000, 1.0}, Body{8'000, 2.0}, Body{40'000, 10.0}}) {
    RecordingHead head = RecordedBench::head();
    head.surface.body_nodes = body.nodes;
    RoomRecorder recorder(head);
    constexpr double kRunS = 60;
    int asked = 0;
    for (Micros t{}; t < from_seconds(kRunS); t += 50ms) {
      FrameJob job;
      job.target = t;
      recorder.begin_frame(job, t);
      asked += job.state;
    }
    INFO(body.nodes << " nodes");
    CHECK(asked == std::lround(kRunS / body.every_s));
    CHECK(asked * 24.0 * body.nodes / kRunS <= RoomRecorder::kCheckpointBytesPerS);
  }
}
