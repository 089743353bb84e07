// Counters of a server for monitoring.
#include "server/core/bin_counts.hpp"
#include "server/core/station_links.hpp"

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("values are counted in the bin whose upper edge is the first not below them") {
  constexpr std::array kEdges{0.0, 0.5, 2.0};
  BinCounts bins{kEdges};
  for (const double value : {0.0, 0.25, 0.5, 1.0, 2.0, 3.0}) bins.add(value);
  const std::vector<std::uint64_t> counted(bins.bins().begin(), bins.bins().end());
  CHECK(counted == std::vector<std::uint64_t>{1, 2, 2, 1});
  CHECK(bins.count() == 6);
  CHECK(bins.sum() == 6.75);
}

TEST_CASE("every frame is in the histogram of frame times, and those with patches in that of patches") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  bench.wait(1s);
  const auto before = bench.core.counts();
  CHECK(before.frame_seconds.count() == before.frames);
  CHECK(before.patches_seconds.count() == 0);
  hand.join().live(2s);
  const auto after = bench.core.counts();
  CHECK(after.frame_seconds.count() == after.frames);
  CHECK(after.patches_seconds.count() > 0);
  CHECK(after.patches_seconds.count() <= after.frames - before.frames);
}

TEST_CASE("patches that were sent stay counted when their station has left") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live(1s);
  const auto of_station = bench.core.stations().at(0).counts;
  CHECK(of_station.patches > 0);
  hand.say(Leave{});
  CHECK(bench.core.counts().patches == of_station.patches);
  CHECK(bench.core.counts().patch_bytes == of_station.patch_bytes);
}

TEST_CASE("a computation that lasts is known while it does") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join();
  std::optional<FrameJob> job;
  while (!job) {
    bench.now += 1ms;
    hand.say_samples({hand.sample()});
    bench.core.tick(bench.now);
    job = bench.core.next_job(bench.now);
  }
  CHECK(bench.core.computing_since() == bench.now);
  bench.core.finish(bench.room.run(*job), bench.now + 7s);
  CHECK_FALSE(bench.core.computing_since());
  CHECK(bench.core.counts().frame_seconds.bins().back() == 1);
}

TEST_CASE("bytes of strangers are counted both ways, a station's are not among them") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join();
  const auto joined = bench.core.counts();
  CHECK(joined.bytes_from_strangers == kHelloBytes);
  CHECK(joined.bytes_to_strangers > 0);
  CHECK(joined.bytes_to_strangers <= joined.bytes_from_strangers);
  hand.live();
  CHECK(bench.core.counts().bytes_from_strangers == joined.bytes_from_strangers);
  CHECK(bench.core.counts().bytes_to_strangers == joined.bytes_to_strangers);
}

TEST_CASE("late ticks are summed over stations that come and go, from what each had when it came") {
  StationLinks links;
  const auto station = [](StationId id, std::uint32_t late) {
    StationReport report;
    report.id = id;
    report.ticks_late = late;
    return report;
  };
  links.observe({station(1, 100)});
  CHECK(links.ticks_late == 0);
  links.observe({station(1, 103), station(2, 50)});
  links.observe({station(2, 51)});
  links.observe({station(2, 10), station(1, 500)});  // its loop was restarted
  links.observe({station(2, 11), station(1, 500)});
  CHECK(links.ticks_late == 3 + 1 + 1);
  CHECK(links.rtt_seconds.count() == 0);  // no station has reported it
}
