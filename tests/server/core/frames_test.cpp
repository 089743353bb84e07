#include <map>

#include "raw_station.hpp"

using namespace palpate;
using namespace std::chrono_literals;

TEST_CASE("without a station the body runs on the server's clock") {
  Bench bench;
  bench.wait(1s);
  CHECK(bench.room.jobs.size() == 20);
  CHECK(bench.room.jobs.back().target == 6s);
  CHECK(bench.room.jobs.front().target == 5s + 50ms);
  CHECK_FALSE(bench.room.jobs.back().shapes);
}

TEST_CASE("frames fall due at multiples of the period, without drift") {
  Bench bench(ContactKind::touch, 30);
  bench.now = 5s;
  for (int k = 1; k <= 3000; ++k) {
    const auto due = 5s + from_seconds(k / 30.0);
    REQUIRE(bench.core.deadline() == due);
    bench.core.tick(due - 1us);
    REQUIRE_FALSE(bench.core.next_job(due - 1us));
    bench.now = due;
    bench.tick();
  }
  CHECK(bench.room.jobs.size() == 3000);
}

TEST_CASE("a frame goes up to the newest sample and has all that led there") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.clock_offset = -4s;
  hand.join().live();
  // From now on a datagram takes 30 ms: an arriving sample was read 30 ms ago.
  for (int i = 0; i < 200; ++i) {
    bench.now += 1ms;
    if (i >= 30) hand.say_samples({hand.sample(30ms)});
    bench.tick();
  }
  const auto& job = bench.room.jobs.back();
  const auto before = bench.room.jobs[bench.room.jobs.size() - 2].target;
  CHECK(std::abs((bench.now - 30ms - job.target).count()) < 100);
  REQUIRE(job.stations.size() == 1);
  CHECK(job.stations[0].samples.front().t <= before);
  CHECK(job.stations[0].samples.back().t >= job.target);
  CHECK(job.stations[0].samples.size() == 51);
  for (std::size_t i = 1; i < job.stations[0].samples.size(); ++i)
    CHECK(job.stations[0].samples[i].t > job.stations[0].samples[i - 1].t);
}

TEST_CASE("a patch comes back stamped with the very time of the sample that ended its frame") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.clock_offset = 123456789us;
  hand.drift = 80e-6;
  hand.join();
  std::vector<Micros> times;
  int patches = 0;
  for (int i = 0; i < 20'000; ++i) {
    bench.now += 1ms;
    hand.hear_all();
    const auto sample = hand.sample(Micros{i % 13 * 300});
    if (times.empty() || sample.t > times.back()) {
      times.push_back(sample.t);
      hand.say_samples({sample});
    }
    bench.sent.clear();
    bench.tick();
    for (const auto& [to, message] : bench.sent)
      if (const auto* patch = std::get_if<PatchMessage>(&message.body)) {
        ++patches;
        const auto nearest = std::lower_bound(times.begin(), times.end(), patch->patch.stamp - 1us);
        REQUIRE(nearest != times.end());
        REQUIRE(*nearest - patch->patch.stamp <= 1us);
      }
  }
  CHECK(patches > 300);
}

TEST_CASE("body time never goes back and a frame without newer samples is a beat") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  const auto frames = bench.room.jobs.size();
  const auto waiting = bench.core.counts().frames_waiting;
  bench.sent.clear();
  bench.wait(100ms);  // less than kLateAfter
  CHECK(bench.room.jobs.size() == frames);
  CHECK(bench.core.counts().frames_waiting == waiting + 2);
  REQUIRE(bench.sent.size() == 2);
  CHECK(std::get<Beat>(bench.sent[0].second.body).contact_in_reach);
  auto last = Micros{};
  for (const auto& job : bench.room.jobs) {
    CHECK(job.target > last);
    last = job.target;
  }
}

TEST_CASE("nobody waits for a late station, and its samples count again when they come") {
  Bench bench;
  RawStation a(bench, 1, "a"), b(bench, 2, "b");
  a.join();
  b.join();
  const auto both = [&](bool b_speaks, int ms) {
    for (int i = 0; i < ms; ++i) {
      bench.now += 1ms;
      a.say_samples({a.sample()});
      if (b_speaks)
        b.say_samples({b.sample(20ms)});
      else if (i % 50 == 0)
        b.say(Beat{});
      bench.tick();
    }
  };
  both(true, 500);
  CHECK(bench.now - bench.room.jobs.back().target >= 19ms);
  both(false, 300);
  CHECK(bench.now - bench.room.jobs.back().target <= 1ms);
  CHECK(bench.room.jobs.back().stations.size() == 2);
  both(true, 200);
  CHECK(bench.now - bench.room.jobs.back().target >= 19ms);
}

TEST_CASE("Samples that stay out are waited for as long as they are late now and then: that grows soon and shrinks slowly") {
  Bench bench;
  RawStation quick(bench, 1, "quick"), shaky(bench, 2, "shaky");
  quick.join();
  shaky.join();
  // Its samples are 4 ms old when they come; for `held` ms of every 50 none does.
  const auto run = [&](int ms, int held) {
    for (int i = 0; i < ms; ++i) {
      bench.now += 1ms;
      quick.say_samples({quick.sample()});
      if (i % 50 >= held) shaky.say_samples({shaky.sample(4ms)});
      bench.tick();
    }
  };
  const auto waits = [&] {
    run(100, 50);
    return bench.now - bench.room.jobs.back().target;
  };
  run(2000, 0);
  CHECK(waits() <= 10ms);
  run(1000, 12);
  const auto grown = waits();
  CHECK(grown >= 14ms);
  CHECK(grown <= kMostWait + 6ms);
  run(50, 0);
  CHECK(waits() >= 10ms);
  run(2000, 0);
  CHECK(waits() <= 10ms);
}

TEST_CASE("A station whose way became shorter is not waited for as before, beside one that is slower still") {
  Bench bench;
  RawStation near(bench, 1, "near"), far(bench, 2, "far");
  near.join();
  far.join();
  const auto run = [&](int ms, Micros way) {
    for (int i = 0; i < ms; ++i) {
      bench.now += 1ms;
      near.say_samples({near.sample(way)});
      far.say_samples({far.sample(400ms)});
      bench.tick();
    }
    return bench.now - bench.room.jobs.back().target;
  };
  CHECK(run(1000, 300ms) >= 300ms);
  CHECK(run(1200, 10ms) <= 10ms + kMostWait + 2ms);
}

TEST_CASE("when the only station falls silent the body goes on at the lag it had") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join();
  for (int i = 0; i < 500; ++i) {
    bench.now += 1ms;
    hand.say_samples({hand.sample(40ms)});
    bench.tick();
  }
  bench.wait(500ms);
  CHECK(std::abs((bench.now - 40ms - bench.room.jobs.back().target).count()) < 1000);
  bench.wait(3s);
  CHECK(bench.core.station_count() == 0);
  CHECK(bench.room.jobs.back().stations.empty());
}

TEST_CASE("duplicates, repeats and samples out of order are taken once") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live(100ms);
  const auto taken = [&] { return bench.core.stations()[0].counts.samples; };
  const auto before = taken();
  bench.now += 10ms;
  std::vector<ToolSample> samples;
  for (int i = 9; i >= 0; --i) samples.push_back(hand.sample(i * 1ms));
  const std::vector<ToolSample> early(samples.begin(), samples.begin() + 6), all = samples;
  hand.say_samples(all);
  hand.say_samples(early);
  hand.say_samples(all);
  CHECK(taken() == before + 10);
  CHECK(bench.core.stations()[0].counts.samples_refused == 0);
}

TEST_CASE("samples from the future are refused") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live(100ms);
  hand.say_samples({hand.sample(-10s)});
  CHECK(bench.core.stations()[0].counts.samples_refused == 1);
  hand.live(100ms);
  CHECK(bench.room.jobs.back().target <= bench.now);
}

TEST_CASE(
    "one job is out at a time, and of what falls due meanwhile the last begins as soon as it is back and the rest is skipped") {
  Bench bench;
  bench.wait(49ms);
  bench.now += 1ms;
  bench.core.tick(bench.now);
  const auto job = bench.core.next_job(bench.now);
  REQUIRE(job);
  for (int i = 0; i < 120; ++i) {
    bench.now += 1ms;
    bench.core.tick(bench.now);
    CHECK_FALSE(bench.core.next_job(bench.now));
  }
  CHECK(bench.core.counts().frames_busy == 1);
  bench.core.finish(bench.room.run(*job), bench.now);
  CHECK(bench.core.counts().frame_time_max == 120ms);
  CHECK(bench.core.deadline() <= bench.now);
  bench.core.tick(bench.now);
  const auto late = bench.core.next_job(bench.now);
  REQUIRE(late);
  CHECK(late->target == bench.now);
  bench.core.finish(bench.room.run(*late), bench.now);
  CHECK(bench.core.deadline() == bench.now + 30ms);
  bench.wait(30ms);
  CHECK(bench.room.jobs.back().target == bench.now);
}

TEST_CASE("a room that could keep up and was late once catches up") {
  Bench bench;
  bench.wait(50ms);
  // A frame takes 20 ms plus 0.4 of its body time: 40 ms for 50, 60 if it spans two.
  std::optional<FrameJob> out;
  Micros ends{}, begun = bench.now;
  for (int i = 0; i < 2000; ++i) {
    bench.now += 1ms;
    if (out && bench.now >= ends) {
      bench.core.finish(bench.room.run(*out), bench.now);
      out.reset();
    }
    bench.core.tick(bench.now);
    if (out) continue;
    if ((out = bench.core.next_job(bench.now))) {
      const bool stalls = bench.now - begun > 300ms && bench.now - begun <= 350ms;
      ends = bench.now + 20ms + (out->target - out->begin) * 2 / 5 + (stalls ? 80ms : 0ms);
    }
  }
  CHECK(bench.core.counts().frames_busy >= 1);
  CHECK(bench.core.counts().frames_busy <= 2);
  CHECK(bench.core.pace().rate_hz == 20);
}

TEST_CASE("a long silence of the process is left out, but for a frame of bounded length") {
  Bench bench;
  bench.now += 10s;
  bench.tick();
  CHECK(bench.room.jobs.back().target == bench.now);
  CHECK(bench.room.jobs.back().begin == bench.now - kLongestFrame);
}

TEST_CASE("only the newest patch is sent, once") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().lossless().live();
  bench.sent.clear();
  for (int k = 0; k < 3; ++k) {  // three frames while nothing is emitted
    bench.now += 50ms;
    Message samples = hand.as;
    samples.clock = hand.sync.stamp(hand.clock());
    samples.body = Samples{{hand.sample()}};
    std::array<std::byte, kMaxDatagramBytes> bytes;
    bench.core.take(std::span(bytes).first(encode(samples, bytes)), 1, bench.now);
    bench.core.tick(bench.now);
    const auto job = bench.core.next_job(bench.now);
    REQUIRE(job);
    bench.core.finish(bench.room.run(*job), bench.now);
  }
  bench.collect();
  REQUIRE(bench.sent.size() == 1);
  CHECK(std::get<PatchMessage>(bench.sent[0].second.body).patch.stamp == hand.clock());
  bench.sent.clear();
  bench.collect();
  CHECK(bench.sent.empty());
}

TEST_CASE("without contact in reach a frame is a beat that tells the body time") {
  Bench bench;
  bench.room.in_reach = false;
  RawStation hand(bench, 1, "hand");
  hand.clock_offset = 7s;
  hand.join().live();
  const auto message = bench.last<Beat>(1);
  REQUIRE(message);
  const auto& beat = std::get<Beat>(message->body);
  CHECK_FALSE(beat.contact_in_reach);
  CHECK(beat.body_time == hand.clock());
  CHECK(bench.core.stations()[0].counts.patches == 0);
}

TEST_CASE("a frame that failed brings no patch and is counted") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().lossless().live();
  const auto patches = bench.core.stations()[0].counts.patches;
  bench.room.fail = true;
  hand.live(100ms);
  CHECK(bench.core.counts().frames_failed == 2);
  CHECK(bench.core.stations()[0].counts.patches == patches);
  bench.room.fail = false;
  hand.live(100ms);
  CHECK(bench.core.stations()[0].counts.patches == patches + 2);
}

TEST_CASE("a patch that fits no datagram is counted and a beat goes instead") {
  Bench bench;
  RawStation hand(bench, 1, "hand");
  hand.join().live();
  bench.sent.clear();
  bench.now += 50ms;
  hand.say_samples({hand.sample()});
  bench.core.tick(bench.now);
  auto result = bench.room.run(*bench.core.next_job(bench.now));
  result.stations[0].patch->tool = Vec3(1e300, 0, 0);  // beyond the range of the wire
  bench.core.finish(result, bench.now);
  bench.collect();
  CHECK(bench.core.stations()[0].counts.patch_too_big == 1);
  REQUIRE(bench.sent.size() == 1);
  CHECK(std::holds_alternative<Beat>(bench.sent[0].second.body));
}

TEST_CASE("a station whose samples stay out for longer than a patch is valid gets beats, and patches again with its samples") {
  Bench bench;
  RawStation hand(bench, 1, "hand"), shadow(bench, 2, "shadow");
  hand.join();
  shadow.hello.shadow_of = "hand";
  shadow.join();
  hand.live();
  const auto valid_for = FakeRoom::patch({}).valid_for;
  const auto patches = [&](Micros time) {
    bench.sent.clear();
    for (const auto end = bench.now + time; bench.now < end;) {
      bench.wait(50ms);
      hand.say(Beat{});  // keeps the session and its path alive
      shadow.say(Beat{});
    }
    return std::count_if(bench.sent.begin(), bench.sent.end(),
                         [](const auto& sent) { return std::holds_alternative<PatchMessage>(sent.second.body); });
  };
  CHECK(patches(valid_for - 60ms) > 0);
  patches(150ms);
  CHECK(patches(1s) == 0);
  CHECK(std::get<Beat>(bench.last<Beat>(1)->body).contact_in_reach);
  hand.live(200ms);
  CHECK(bench.last<PatchMessage>(1));
  CHECK(bench.core.station_count() == 2);
}

TEST_CASE("a room that is far behind leaves out what it cannot make up for, and says how much") {
  Bench bench;
  bench.wait(100ms);
  const Micros before = bench.core.body_time();
  bench.now += 800ms;
  bench.tick();
  CHECK(bench.room.jobs.back().begin == before);  // made up
  CHECK(bench.core.counts().left_out == Micros{});
  bench.wait(500ms);
  CHECK(bench.now - bench.core.body_time() < 60ms);
  const Micros body = bench.core.body_time();
  bench.now += 7s;
  bench.tick();
  const FrameJob& job = bench.room.jobs.back();
  CHECK(job.target == bench.now);
  CHECK(job.target - job.begin == kLongestFrame);
  CHECK(bench.core.counts().left_out == job.begin - body);
}

TEST_CASE("whose tool was let go of is said and counted") {
  Bench bench;
  std::vector<std::string> said;
  bench.core.on_tool_released([&](const Station& station) { said.push_back(station.hello.station); });
  RawStation calm(bench, 1, "calm"), wild(bench, 2, "wild");
  calm.join().live();
  wild.join();
  bench.room.released = {wild.as.station, 12345};
  calm.live(100ms);
  REQUIRE_FALSE(said.empty());
  for (const std::string& name : said) CHECK(name == "wild");
  CHECK(bench.core.counts().tools_released == 2 * said.size());
}
