// Renewal of a station's patch: what is sent instead, to which stations, and when not.
#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

namespace {

struct Stage {
  Bench bench;
  RawStation hand;

  explicit Stage(double deadband = 0.1) : bench(ContactKind::touch, 20, deadband), hand(bench, 1, "hand") {
    hand.clock_offset = -4s;
    hand.join().lossless();
    bench.room.renews = true;
  }
  /// Runs a frame in which the station reports the patch that it plays; records what it is sent at the end.
  void frame(std::uint32_t playing) {
    bench.sent.clear();
    for (int ms = 0; ms < 50; ++ms) {
      bench.now += 1ms;
      Samples samples{{hand.sample()}};
      samples.playing = playing;
      hand.say(samples);
      bench.tick();
    }
  }
  std::vector<std::uint32_t> patches() const {
    std::vector<std::uint32_t> seqs;
    for (const auto& [to, message] : bench.sent)
      if (const auto* patch = std::get_if<PatchMessage>(&message.body)) seqs.push_back(patch->patch.seq);
    return seqs;
  }
  std::vector<Beat> renewals() const {
    std::vector<Beat> beats;
    for (const auto& [to, message] : bench.sent)
      if (const auto* beat = std::get_if<Beat>(&message.body); beat && beat->renewed_from != 0) beats.push_back(*beat);
    return beats;
  }
};

}  // namespace

TEST_CASE("a server says in Welcome how much its patches may be wrong, and only to a station with a tool of its own") {
  Bench bench(ContactKind::touch, 20, 0.1);
  RawStation hand(bench, 1, "hand"), shadow(bench, 2, "shadow"), viewer(bench, 3, "viewer");
  CHECK(std::get<Welcome>(hand.ask().body).deadband == Approx(0.1));
  hand.join();
  shadow.hello.shadow_of = "hand";
  CHECK(std::get<Welcome>(shadow.ask().body).deadband == 0);
  viewer.hello.role = Role::viewer;
  CHECK(std::get<Welcome>(viewer.ask().body).deadband == 0);
}

TEST_CASE("a station gets patches until it says which it plays, then a beat that names the oldest that is renewed") {
  Stage stage;
  stage.frame(0);
  stage.frame(0);
  const auto sent = stage.patches();
  REQUIRE(sent.size() == 1);
  CHECK(stage.renewals().empty());
  stage.frame(sent[0]);
  CHECK(stage.patches().empty());
  const auto beats = stage.renewals();
  REQUIRE(beats.size() == 1);
  CHECK(beats[0].renewed_from == sent[0]);
  CHECK(stage.bench.core.stations().at(0).counts.renewed == 1);
  CHECK(beats[0].contact_in_reach);
  CHECK(std::abs((beats[0].body_time - stage.hand.clock()).count()) <= 2000);
  // A station that plays a patch without all of its parts has to be sent the next complete one.
  stage.frame(0);
  CHECK(stage.patches() == std::vector<std::uint32_t>{sent[0] + 1});
}

TEST_CASE("what a datagram says that was overtaken, or a patch that never was, changes nothing") {
  Stage stage;
  stage.frame(0);
  const std::uint32_t first = stage.patches().at(0);
  stage.frame(0);
  const std::uint32_t second = stage.patches().at(0);
  stage.frame(second);
  CHECK(stage.renewals().at(0).renewed_from == second);
  stage.frame(first);
  CHECK(stage.renewals().at(0).renewed_from == second);
  stage.frame(second + 17);
  CHECK(stage.renewals().at(0).renewed_from == second);
}

TEST_CASE("a beat in place of a patch goes in as many datagrams as the patch would") {
  Stage stage;
  stage.hand.say(Beat{.link = {1000, 100, 2, {}}});
  stage.frame(0);
  const auto sent = stage.patches();
  REQUIRE(sent.size() == 3);
  stage.frame(sent[0]);
  CHECK(stage.renewals().size() == 3);
}

TEST_CASE("a patch is not renewed for a station of whose tool nothing is known for longer than it is valid") {
  Stage stage;
  stage.frame(0);
  stage.frame(stage.patches().at(0));
  REQUIRE(stage.renewals().size() == 1);
  for (int ms = 0; ms < 2500; ++ms) {
    stage.bench.now += 1ms;
    if (ms % 100 == 0) stage.hand.say(Beat{});
    if (ms == 1200) stage.bench.sent.clear();  // its patch is valid for a second
    stage.bench.tick();
  }
  CHECK(stage.renewals().empty());
  CHECK(stage.patches().empty());
}

TEST_CASE("a server without a deadband renews nobody's patch") {
  Stage stage(0);
  stage.frame(0);
  const auto sent = stage.patches();
  REQUIRE(sent.size() == 1);
  stage.frame(sent[0]);
  CHECK(stage.patches().size() == 1);
  CHECK(stage.renewals().empty());
  CHECK_FALSE(stage.bench.room.jobs.back().stations.at(0).playing);
}
