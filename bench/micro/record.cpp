// Cost of recording: processor time and bytes per second of a session, at the server and at the client, and for reading. The
// patch is the server's own, computed beforehand. Only the recording is timed, up to the bytes for the file; the file's own
// thread merely hands them to the system.
#include <array>

#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/machine.hpp"
#include "bench/micro/timer.hpp"
#include "common/record/reader.hpp"
#include "common/record/writer.hpp"
#include "common/wire/codec.hpp"
#include "server/record/room_recorder.hpp"

#include <benchmark/benchmark.h>

namespace palpate {
namespace {

constexpr int kFrameHz = 20, kTickHz = 1000;
constexpr Micros kSecond{1'000'000}, kFrame = kSecond / kFrameHz, kEachTick = kSecond / kTickHz;

/// Two seconds of the organ, with every vertex moving.
const std::vector<std::vector<Vec3>>& organ_shapes() {
  static const auto shapes = [] {
    std::vector<std::vector<Vec3>> moved(2 * kFrameHz, scene_of("organ-buckling").body.nodes);
    for (std::size_t k = 0; k < moved.size(); ++k)
      for (Vec3& x : moved[k]) x *= 1 + 1e-3 * static_cast<double>(k);
    return moved;
  }();
  return shapes;
}

RecordingHead room_head() {
  RecordingHead head;
  head.rate_hz = kFrameHz;
  head.surface = recorded_surface(scene_of("organ-buckling"));
  return head;
}

/// Adds a second of a room with one hand from `t` on, as RoomRecorder writes it, with shapes every `shape_every` frames (0:
/// none).
void add_room_second(RecordingWriter& writer, Micros t, int shape_every) {
  const auto& shapes = organ_shapes();
  for (int k = 0; k < kFrameHz; ++k, t += kFrame) {
    const auto& positions = shapes[static_cast<std::size_t>(t / kFrame) % shapes.size()];
    RecordedPath path{1, {}};
    for (Micros s{0}; s < kFrame; s += kEachTick)
      path.samples.push_back({t + s, Vec3(0.1, 0.1, 1e-9 * static_cast<double>(s.count()))});
    writer.add(path);
    writer.add(RecordedFrame{t, Micros{8'000}, Micros{60'000}, 0, 5, 0, 9, false});
    RecordedTouch touch;
    touch.t = t;
    touch.station = 1;
    touch.contact = touch.has_patch = true;
    writer.add(touch);
    if (shape_every > 0 && k % shape_every == 0) writer.add_shape(t, positions);
    if (k % 5 == 0) writer.add(RecordedLink{t, 1, {}, {}, {}, {}, {}, 1, 0});
    writer.tick(t);
  }
}

/// Adds a second of a station: its ticks, and a patch per frame.
void add_station_second(RecordingWriter& writer, Micros t, const std::vector<std::byte>& patch) {
  for (int k = 0; k < kTickHz; ++k, t += kEachTick) {
    RecordedTick tick;
    tick.t = t;
    tick.position = Vec3(0.1, 0.1, 1e-6 * k);
    tick.force = tick.model_force = Vec3(0, 0, 1);
    writer.add(tick);
    if (k % (kTickHz / kFrameHz) != 0) continue;
    writer.add(RecordedPacket{t, patch});
    writer.tick(t);
  }
}

std::vector<std::byte> patch_datagram() {
  Message message;
  message.instance = 1;
  message.station = 1;
  message.body = PatchMessage{touch_patch()};
  std::vector<std::byte> bytes(kMaxDatagramBytes);
  bytes.resize(encode(message, bytes));
  return bytes;
}

void report(benchmark::State& state, double computing_s, std::size_t bytes) {
  const auto seconds = static_cast<double>(state.iterations());
  state.counters["percent_of_core"] = 100 * computing_s / seconds;
  state.counters["kb_s"] = 1e-3 * static_cast<double>(bytes) / seconds;
}

void record_room(benchmark::State& state, int shape_every) {
  organ_shapes();
  RecordingWriter writer(room_head());
  std::size_t bytes = 0;
  Micros t{0};
  writer.take();
  const ProcessorTimer timer;
  for (auto _ : state) {
    add_room_second(writer, t, shape_every);
    bytes += writer.take().size();
    t += kSecond;
  }
  report(state, timer.seconds(), bytes);
}

void record_station(benchmark::State& state) {
  const auto patch = patch_datagram();
  RecordingWriter writer(RecordingHead{});
  std::size_t bytes = 0;
  Micros t{0};
  const ProcessorTimer timer;
  for (auto _ : state) {
    add_station_second(writer, t, patch);
    bytes += writer.take().size();
    t += kSecond;
  }
  report(state, timer.seconds(), bytes);
}

/// Opens a recording of a minute and reads all of it; per second of the session.
void read_room(benchmark::State& state) {
  constexpr int kLengthS = 60;
  RecordingWriter writer(room_head());
  for (int k = 0; k < kLengthS; ++k) add_room_second(writer, k * kSecond, 2);
  writer.finish();
  const auto file = writer.take();
  const ProcessorTimer timer;
  for (auto _ : state) {
    const RecordingReader recording(file, "bench");
    for (std::size_t k = 0; k < recording.blocks().size(); ++k) benchmark::DoNotOptimize(recording.read(k));
  }
  state.counters["percent_of_core"] = 100 * timer.seconds() / static_cast<double>(state.iterations()) / kLengthS;
  state.counters["kb_s"] = 1e-3 * static_cast<double>(file.size()) / kLengthS;
}

}  // namespace

void add_record_benchmarks() {
  benchmark::RegisterBenchmark("record/room", record_room, 2)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("record/room_without_shapes", record_room, 0)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("record/station", record_station)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark("record/read_room", read_room)->Unit(benchmark::kMicrosecond);
}

}  // namespace palpate
