// --check-link: its measurements over a real relay, and its verdicts on given figures.
#include "client/io/link_check.hpp"

#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

#include "common/io/monotonic.hpp"
#include "common/io/udp_relay.hpp"
#include "server/io/udp_server.hpp"

using namespace palpate;

namespace {

/// A server and a relay in front of it, each on its own thread.
class Road {
 public:
  explicit Road(const LinkSpec& link)
      : relay_(io_, bind_udp(io_, "test", resolve_udp("test", "127.0.0.1:0")), shell_.address(), link) {}
  ~Road() {
    asio::post(shell_.context(), [this] { shell_.stop(); });
    io_.stop();
  }
  std::string address() const { return to_string(relay_.address()); }

 private:
  UdpServer shell_{{{"cube", load_scene(PALPATE_SOURCE_DIR "/scenes/cube6.json")}}, {"127.0.0.1:0", 20, 1}, {}};
  asio::io_context io_{1};
  UdpRelay relay_;
  std::jthread server_{[this] { shell_.run(); }}, road_{[this] { io_.run(); }};
};

LinkFigures measured(const LinkSpec& link, Micros duration) {
  Road road(link);
  const std::atomic<bool> stop{false};
  return measure_link(road.address(), "check", duration, false, stop);
}

LinkFigures good_figures() {
  LinkFigures f;
  f.joined = true;
  f.rate_hz = 30;
  f.round_trips = 500;
  f.rtt_p50_ms = 40;
  f.rtt_p99_ms = 60;
  f.datagrams_down_s = 60;
  f.ticks = 10'000;
  return f;
}

bool says(const LinkVerdict& verdict, const std::string& text) {
  for (const std::string& word : verdict.words)
    if (word.find(text) != std::string::npos) return true;
  return false;
}

}  // namespace

TEST_CASE("a good link is measured as what it is, and serves") {
  LinkSpec link;
  link.latency = Micros{15'000};
  const LinkFigures f = measured(link, Micros{2'000'000});
  INFO(describe(f));
  REQUIRE(f.joined);
  CHECK(f.rate_hz == 20);
  CHECK(f.rtt_p50_ms >= 30);
  CHECK(f.round_trips > 10);
  CHECK(f.down.share == 0);
  CHECK(f.up.share == 0);
  CHECK(f.duplicated == 0);
  CHECK(f.ticks > 0);
  CHECK(f.uplink_kbit_s > 0);
  const LinkVerdict verdict = judge(f);
  CHECK(verdict.link_serves);
  CHECK(says(verdict, "set: palpate-client --passivity"));
  CHECK(says(verdict, "chooses scheme hyper"));
}

TEST_CASE("a link that loses too much for nonlinear patches is said to get linear ones") {
  LinkFigures f;
  f.joined = true;
  f.rate_hz = 20;
  f.rtt_p50_ms = f.rtt_p99_ms = 40;
  f.down = {0.15, 2};
  const LinkVerdict verdict = judge(f);
  REQUIRE(verdict.link_serves);
  CHECK(says(verdict, "chooses scheme port"));
}

TEST_CASE("a bad link is measured as what it is, and does not serve") {
  LinkSpec link;
  link.latency = Micros{20'000};
  link.jitter = Micros{20'000};
  link.loss = 0.45;
  link.burst_mean = 4;
  link.duplicate = 0.2;
  const LinkFigures f = measured(link, Micros{6'000'000});
  INFO(describe(f));
  if (f.joined) {
    CHECK(f.down.share > 0.25);
    CHECK(f.up.share > 0.25);
    CHECK(f.down.longest_run > 2);
    CHECK(f.up.longest_run > 2);
    CHECK(f.duplicated > 0);
    CHECK(f.spread_ms > 0);
    CHECK(f.jitter_ms > 0);
    CHECK(f.jitter_ms < f.spread_ms);  // neighbours differ by less than the slowest and the fastest
  }
  const LinkVerdict verdict = judge(f);
  CHECK_FALSE(verdict.link_serves);
  CHECK_FALSE(verdict.serves());
  CHECK(says(verdict, "no: "));
}

TEST_CASE("nobody there is no link") {
  const std::atomic<bool> stop{false};
  const LinkFigures f = measure_link("127.0.0.1:9", "check", Micros{300'000}, false, stop);
  CHECK_FALSE(f.joined);
  CHECK_FALSE(judge(f).serves());
  CHECK(says(judge(f), "nothing listens at 127.0.0.1:9"));
}

TEST_CASE("a verdict names each reason, and what to set") {
  CHECK(judge(good_figures()).serves());
  LinkFigures f = good_figures();
  f.rtt_p99_ms = 1200;
  CHECK(says(judge(f), "1233 ms old"));
  CHECK_FALSE(judge(f).link_serves);
  f = good_figures();
  f.rtt_p99_ms = 400;
  CHECK(judge(f).serves());
  CHECK(says(judge(f), "--passivity on"));
  f = good_figures();
  f.up.share = 0.35;
  CHECK(says(judge(f), "lost"));
  CHECK_FALSE(judge(f).serves());
  f = good_figures();
  f.down = {0.05, 40};
  CHECK(says(judge(f), "the force fades meanwhile"));
  CHECK_FALSE(judge(f).serves());
  f = good_figures();
  f.skipped_ticks = 500;
  CHECK(judge(f).link_serves);
  CHECK_FALSE(judge(f).machine_serves);
  CHECK(says(judge(f), "this machine skips 500"));
  f = good_figures();
  f.late_ticks = 2000;
  CHECK(judge(f).serves());
  CHECK(says(judge(f), "late by more than 0.2 ms"));
  f = good_figures();
  f.rate_hz = 20;
  CHECK(says(judge(f), "--rate-hz 50"));
}
