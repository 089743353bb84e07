// A station's recording: its account of the session, and the datagrams that it keeps.
#include "client/record/station_recorder.hpp"

#include <catch2/catch.hpp>

#include "common/record/reader.hpp"
#include "small_world.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

std::vector<RecordedEvent> events_of(StationRecorder& recorder) {
  recorder.finish();
  const auto bytes = recorder.take();
  const RecordingReader recording(bytes, "station");
  std::vector<RecordedEvent> events;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    REQUIRE(block);
    events.insert(events.end(), block->events.begin(), block->events.end());
  }
  return events;
}

RecordingHead head() {
  RecordingHead head;
  head.kind = RecordingKind::station;
  head.name = "hand";
  head.rate_hz = 1000;
  return head;
}

}  // namespace

TEST_CASE("joining, losing the server, refusals and an overrunning server are recorded when they begin", "[record]") {
  StationRecorder recorder(head());
  Welcome welcome;
  welcome.scene = "organ";
  welcome.rate_hz = 20;
  ServerPace slow;
  slow.rate_hz = 11;
  slow.behind = 70ms;
  Micros now{};
  const auto look = [&](LinkState link, const std::string& refusal, const ServerPace& pace) {
    for (int i = 0; i < 3; ++i) recorder.look(link, welcome, refusal, pace, now += 20ms);
  };
  look(LinkState::joining, "", {});
  look(LinkState::refused, "the room is full", {});
  look(LinkState::joined, "", {});
  look(LinkState::joined, "", slow);
  look(LinkState::joined, "", {});
  look(LinkState::joining, "", {});
  look(LinkState::joined, "", {});
  std::vector<std::string> said;
  for (const RecordedEvent& event : events_of(recorder)) said.push_back(std::string(name_of(event.kind)) + ": " + event.text);
  CHECK(said == std::vector<std::string>{"refused: the room is full", "joined: scene organ at 20 Hz",
                                         "overrun: 11.0 of 20 frames a second, 70 ms behind", "kept_up: ", "silent: the server",
                                         "joined: scene organ at 20 Hz"});
}

TEST_CASE("patches are kept as they came, and nothing else that the server says", "[record]") {
  SmallWorld world;
  ClientCore& core = world.add(1, "hand", 3s);
  world.run(1s);
  REQUIRE(core.link() == LinkState::joined);
  StationRecorder recorder(head());
  recorder.datagram(core, {}, world.clock(1));  // from here on
  std::vector<std::vector<std::byte>> patches;
  std::array<std::byte, kMaxDatagramBytes> out;
  const auto take = [&](Payload body) {
    const Micros sent = world.places[1].sent;
    const ClockStamps clock{world.now, sent, world.clock(1) - sent};
    const Message real = world.newest(1);
    const Message message{real.instance, real.station, 1'000'000, clock, std::move(body)};
    const auto bytes = std::span(out).first(encode(message, out));
    core.take(bytes, world.clock(1));
    recorder.datagram(core, bytes, world.clock(1));
    if (std::holds_alternative<PatchMessage>(message.body)) patches.emplace_back(bytes.begin(), bytes.end());
  };
  take(Beat{});
  take(PatchMessage{FakeRoom::patch(world.clock(1))});
  take(Beat{});
  take(PatchMessage{FakeRoom::patch(world.clock(1))});
  recorder.finish();
  const auto bytes = recorder.take();
  const auto block = RecordingReader(bytes, "station").read(0);
  REQUIRE(block);
  std::vector<std::vector<std::byte>> kept;
  for (const RecordedPacket& packet : block->packets)
    if (!packet.bytes.empty()) kept.push_back(packet.bytes);
  CHECK(kept == patches);
  REQUIRE_FALSE(block->links.empty());
  CHECK(block->links.front().offset == core.clock().offset());
}
