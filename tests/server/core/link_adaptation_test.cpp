// The server's adaptation to a station's link: age of its patches, number of copies, and validity.
#include <map>

#include "raw_station.hpp"
#include "tests/common/wire/seeds.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("the prediction horizon of a patch is round trip, computation and frame") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join();
  // Every answer arrives 60 ms after it was sent; every datagram of the station arrives at once.
  std::deque<std::pair<Micros, Message>> under_way;
  for (int i = 0; i < 6000; ++i) {
    bench.now += 1ms;
    for (const auto& [to, message] : bench.sent) under_way.emplace_back(bench.now + 59ms, message);
    bench.sent.clear();
    for (; !under_way.empty() && under_way.front().first <= bench.now; under_way.pop_front()) hand.hear(under_way.front().second);
    hand.say_samples({hand.sample()});
    bench.tick();
  }
  CHECK(std::abs((bench.room.jobs.back().stations[0].horizon - 110ms).count()) < 2000);
}

TEST_CASE(
    "the prediction horizon of a station's patches is the age that it measures, within reason, and before that what the round "
    "trip says") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  CHECK(bench.room.jobs.back().stations.at(0).horizon >= Micros{50'000});
  CHECK(bench.room.jobs.back().stations.at(0).horizon < Micros{60'000});
  hand.say(Beat{.link = {0, 0, 0, Micros{187'000}}});
  hand.live(Micros{100'000});
  CHECK(bench.room.jobs.back().stations.at(0).horizon == Micros{187'000});
  hand.say(Beat{.link = {0, 0, 0, Micros{4'000'000'000}}});
  hand.live(Micros{100'000});
  CHECK(bench.room.jobs.back().stations.at(0).horizon == kHorizonMost);
}

TEST_CASE("A patch for a quick station beside a slow one, or for its shadow, is made for the age that the slow one gives it") {
  Bench bench;
  RawStation quick(bench, 1, "quick"), slow(bench, 2, "slow"), shadow(bench, 3, "shadow");
  quick.join();
  slow.join();
  shadow.hello.shadow_of = "slow";
  shadow.join();
  for (int i = 0; i < 1500; ++i) {
    bench.now += 1ms;
    quick.say_samples({quick.sample()});
    slow.say_samples({slow.sample(80ms)});
    if (i % 50 == 0) shadow.say(Beat{});
    bench.tick();
  }
  const auto& job = bench.room.jobs.back();
  const auto behind = bench.now - job.target;
  REQUIRE(job.stations.size() == 3);
  for (const StationJob& station : job.stations) CHECK(station.horizon >= behind + 50ms);

  Bench late;
  RawStation far(late, 1, "far"), beside(late, 2, "beside");
  far.join();
  beside.hello.shadow_of = "far";
  beside.join();
  for (int i = 0; i < 1500; ++i) {
    late.now += 1ms;
    far.say_samples({far.sample(400ms)});
    if (i % 50 == 0) beside.say(Beat{});
    late.tick();
  }
  for (const StationJob& station : late.room.jobs.back().stations) CHECK(station.horizon >= 450ms);
}

TEST_CASE(
    "a grasp that leaves the order to the server gets fewer moments where patches must last long, and what it asked for else") {
  Bench bench(ContactKind::attach);
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  CHECK(bench.room.jobs.back().stations.at(0).order == 0);
  hand.say(Beat{.link = {0, 0, 0, Micros{187'000}}});
  hand.live(Micros{100'000});
  CHECK(bench.room.jobs.back().stations.at(0).order == 16);

  Bench other(ContactKind::attach);
  RawStation choosy(other, 1, "choosy");
  choosy.hello.order = 22;
  choosy.join().live();
  choosy.say(Beat{.link = {0, 0, 0, Micros{187'000}}});
  choosy.live(Micros{100'000});
  CHECK(other.room.jobs.back().stations.at(0).order == 22);
}

TEST_CASE("a station that gets patches is told four times a second how its datagrams fare") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  bench.sent.clear();
  for (int ms = 0; ms < 2000; ++ms) {
    bench.now += Micros{1'000};
    if (ms % 20 == 7) ++hand.as.seq;  // lost on the way
    hand.say_samples({hand.sample()});
    bench.tick();
  }
  int beats = 0;
  LinkReport report;
  for (const auto& [to, message] : bench.sent)
    if (const auto* beat = std::get_if<Beat>(&message.body)) {
      ++beats;
      report = beat->link;
    }
  CHECK(beats >= 6);
  CHECK(beats <= 9);
  CHECK(report.judged > 900);
  CHECK(report.longest_run == 1);
  CHECK(static_cast<double>(report.lost) / report.judged == Approx(1.0 / 21).epsilon(0.1));
}

namespace {

/// Number of datagrams with each patch of the next second, by its seq.
std::map<std::uint32_t, int> copies_in_a_second(Bench& bench, RawStation& hand) {
  bench.sent.clear();
  hand.live(Micros{1'000'000});
  std::map<std::uint32_t, int> count;
  for (const auto& [to, message] : bench.sent)
    if (const auto* patch = std::get_if<PatchMessage>(&message.body)) ++count[patch->patch.seq];
  REQUIRE(count.size() >= 19);
  return count;
}

}  // namespace

TEST_CASE("patches go as many times as keeps them from getting lost, twice until the station has said what it loses") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  const auto copies = [&](const LinkReport& report) {
    hand.say(Beat{.link = report});
    hand.live(Micros{50'000});
    const auto count = copies_in_a_second(bench, hand);
    return count.begin()->second + count.rbegin()->second;
  };
  CHECK(copies({0, 0, 0, {}}) == 4);
  CHECK(copies({10, 0, 0, {}}) == 4);  // too few to judge by
  CHECK(copies({1000, 0, 0, {}}) == 2);
  CHECK(copies({1000, 40, 2, {}}) == 4);    // 0.04^2 = 0.16 %
  CHECK(copies({1000, 50, 2, {}}) == 6);    // 0.05^2 = 0.25 %
  CHECK(copies({1000, 500, 20, {}}) == 6);  // the maximum
  CHECK(copies({1000, 2, 1, {}}) == 2);
}

TEST_CASE("Patches are valid for as long as the link's longest run of losses may last, within bounds") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  const auto silence = [&](const LinkReport& report) {
    hand.say(Beat{.link = report});
    hand.live(Micros{100'000});
    return bench.room.jobs.back().stations.at(0).silence;
  };
  CHECK(silence({0, 0, 0, {}}) == kSilenceLeast);
  CHECK(silence({1000, 0, 0, {}}) == kSilenceLeast);
  CHECK(silence({1000, 40, 2, {}}) == kSilenceLeast);      // twice each: one frame of 50 ms lost, the next comes after 100
  CHECK(silence({1000, 300, 18, {}}) == Micros{525'000});  // three times each: six frames lost, 1.5 * 7 frames
  CHECK(silence({1000, 900, 800, {}}) == kSilenceMost);
}

TEST_CASE("a patch with terms goes once whatever the link loses: the patch before it, with its own, is nearly as good") {
  Bench bench(ContactKind::attach);
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  hand.say(Beat{.link = {1000, 50, 2, {}}});
  hand.live(Micros{50'000});
  bench.room.terms = seeds::spring_terms(6, true, 60, 40);
  CHECK(std::next(copies_in_a_second(bench, hand).begin())->second == 1);
  bench.room.terms = {};
  CHECK(std::next(copies_in_a_second(bench, hand).begin())->second == 3);
}
