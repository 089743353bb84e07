// Messages for stations from frames, by PatchSender alone.
#include "server/core/patch_sender.hpp"

#include <catch2/catch.hpp>

#include "fake_room.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

constexpr Micros kNow{10'000'000};
constexpr Micros kOffset{3'000'000};  // the station's clock minus ours

Station hand() {
  Station station;
  station.id = 1;
  const auto own = [](Micros t) { return t + kOffset; };
  station.clock.take({own(kNow - 60ms), kNow - 60ms, Micros{0}}, kNow - 60ms);
  for (Micros t = kNow - 50ms; t <= kNow; t += 1ms)
    station.tool.take(Samples{{{own(t), Vec3::Zero()}}}, station.clock, Micros{}, t, [](const ButtonChange&) {});
  return station;
}

struct Sent {
  Stations stations;
  PatchSender sender{ServerOptions{.draw = {}, .rate_hz = 20}};
  BodyNow body{kNow, {20, 1ms}, 0, false, {}};

  Sent() { stations[1] = hand(); }
  void frame(std::optional<Patch> patch) {
    FrameResult result;
    result.stamp = kNow;
    result.stations.push_back({1, std::move(patch), {}, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), true});
    sender.take(result, stations, body, kNow);
  }
  std::vector<Payload> all() {
    std::vector<Payload> bodies;
    std::array<std::byte, kMaxDatagramBytes> bytes;
    while (const auto size = sender.emit(stations, stations[1], bytes, kNow)) {
      Message message;
      REQUIRE(decode(std::span(bytes).first(size), message) == WireFault::none);
      bodies.push_back(std::move(message.body));
    }
    return bodies;
  }
};

}  // namespace

TEST_CASE("A patch leaves in the station's clock, as often as its losses ask for, and then no more") {
  Sent sent;
  sent.stations[1].next_report = kNow + 1s;
  for (const auto& [lost, copies] : {std::pair{0, 1}, {20, 2}, {100, 3}}) {
    sent.stations[1].link.take(Beat{.link = {1000, static_cast<std::uint16_t>(lost), 0, {}}});
    sent.frame(FakeRoom::patch(kNow - 10ms));
    const auto bodies = sent.all();
    REQUIRE(bodies.size() == static_cast<std::size_t>(copies));
    for (const Payload& body : bodies) {
      REQUIRE(std::holds_alternative<PatchMessage>(body));
      CHECK(std::get<PatchMessage>(body).patch.stamp == kNow - 10ms + kOffset);
    }
    CHECK(sent.all().empty());
  }
}

TEST_CASE("A patch of a force beyond what the wire carries leaves with the most that it does, and can be read") {
  Sent sent;
  auto patch = FakeRoom::patch(kNow - 10ms);
  patch.force = Vec3(3e4, -2, -7e6);
  sent.frame(patch);
  const auto bodies = sent.all();
  REQUIRE_FALSE(bodies.empty());
  CHECK(std::get<PatchMessage>(bodies[0]).patch.force.isApprox(Vec3(1e4, -2, -1e4)));
}

TEST_CASE("Where no contact is in reach, and where the tool was lost for longer than the patch lasts, a beat goes instead") {
  Sent sent;
  sent.frame(std::nullopt);
  auto bodies = sent.all();
  REQUIRE(bodies.size() == 1);
  REQUIRE(std::holds_alternative<Beat>(bodies[0]));
  CHECK_FALSE(std::get<Beat>(bodies[0]).contact_in_reach);
  CHECK(std::get<Beat>(bodies[0]).body_time == kNow + kOffset);
  Patch patch = FakeRoom::patch(kNow + 200ms);
  patch.valid_for = 199ms;
  sent.frame(patch);
  bodies = sent.all();
  REQUIRE(bodies.size() == 1);
  CHECK(std::get<Beat>(bodies[0]).contact_in_reach);
}

TEST_CASE("A room that falls behind is told of beside the very next patch, and again when it keeps up") {
  Sent sent;
  sent.stations[1].next_report = kNow + 1s;
  const auto beats = [&] {
    sent.frame(FakeRoom::patch(kNow));
    int count = 0;
    for (const Payload& body : sent.all()) count += std::holds_alternative<Beat>(body);
    return count;
  };
  CHECK(beats() == 0);
  sent.body.pace.rate_hz = 10;
  CHECK(beats() == 1);
  CHECK(beats() == 0);
  sent.body.pace.rate_hz = 20;
  CHECK(beats() == 1);
}
