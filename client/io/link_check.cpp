#include "client/io/link_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <thread>

#include "client/core/client_core.hpp"
#include "client/device/replay_device.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/udp_client.hpp"
#include "common/io/monotonic.hpp"
#include "common/wire/scheme_in_use.hpp"

namespace palpate {
namespace {

constexpr Micros kPoll{10'000};

/// Counts of the network thread, datagram by datagram. Read after the thread has ended.
struct Seen {
  Histogram<20'000> rtt_us{100};
  double rtt_least_ms = 0, up_share_sum = 0;
  std::uint64_t exchanges = 0, reports = 0;
  int up_run = 0;

  void look(const ClientCore& core) {
    if (core.clock().exchanges() != exchanges) {
      exchanges = core.clock().exchanges();
      rtt_us.add(core.clock().rtt().last.count());
      rtt_least_ms = 1e3 * seconds(core.clock().rtt().min);
    }
    const LinkReport& report = core.server_report();
    if (report.judged == 0) return;
    ++reports;
    up_share_sum += static_cast<double>(report.lost) / report.judged;
    up_run = std::max(up_run, static_cast<int>(report.longest_run));
  }
};

void fill_link(LinkFigures& figures, const ClientCore& core, const Seen& seen, Micros lasted) {
  const SeqCounts& loss = core.loss();
  const auto sent = loss.received + loss.lost;
  const double lasted_s = std::max(seconds(lasted), 1e-3);
  figures.round_trips = seen.rtt_us.count();
  figures.rtt_p50_ms = 1e-3 * static_cast<double>(seen.rtt_us.percentile(0.5));
  figures.rtt_p99_ms = 1e-3 * static_cast<double>(seen.rtt_us.percentile(0.99));
  figures.spread_ms = std::max(0.0, figures.rtt_p99_ms - seen.rtt_least_ms);
  figures.jitter_ms = 1e3 * seconds(core.clock().rtt().jitter);
  figures.up = {seen.reports > 0 ? seen.up_share_sum / static_cast<double>(seen.reports) : 0, seen.up_run};
  figures.down = {sent > 0 ? static_cast<double>(loss.lost) / static_cast<double>(sent) : 0, core.link_report().longest_run};
  figures.datagrams_down_s = static_cast<double>(loss.received) / lasted_s;
  figures.reordered = loss.late;
  figures.duplicated = loss.duplicates;
  figures.uplink_kbit_s = 8e-3 * static_cast<double>(core.counts().bytes_sent) / lasted_s;
  figures.downlink_kbit_s = 8e-3 * static_cast<double>(core.counts().bytes_received) / lasted_s;
}

void fill_loop(LinkFigures& figures, const HapticLoopStats& stats) {
  figures.ticks = stats.ticks;
  figures.late_ticks = stats.late;
  figures.skipped_ticks = stats.skipped;
  figures.lateness_p99_ms = 1e-3 * static_cast<double>(stats.late_us.percentile(0.99));
}

}  // namespace

LinkFigures measure_link(const std::string& server, const std::string& station, Micros duration, bool realtime,
                         const std::atomic<bool>& stop, const std::optional<ClientKeys>& keys) {
  LinkFigures figures;
  ClientOptions options;
  options.hello.station = station;
  options.hello.alike = true;
  options.hello.role = Role::viewer;
  ClientCore core(options, monotonic_now());
  Seen seen;
  UdpClient client(
      server, core, {}, [&seen](const ClientCore& c, auto, auto) { seen.look(c); }, keys);
  client.start();
  Micros begin = monotonic_now();
  const auto wait_until = [&](const auto& done) {
    while (!stop && !done() && monotonic_now() - begin < duration) std::this_thread::sleep_for(kPoll);
  };
  wait_until([&] { return client.status().link == LinkState::joined; });
  const ClientStatus status = client.status();
  figures.joined = status.link == LinkState::joined;
  figures.refusal = status.refusal;
  figures.no_answer = no_answer_text(server, status.nobody_listens, keys.has_value());
  figures.rate_hz = figures.joined ? status.welcome.rate_hz : 0;
  if (figures.joined) {
    begin = monotonic_now();
    ReplayDevice device(Motion::rest(status.welcome.home, 1.0));
    device.wait_for_start();
    HapticLoop loop(device, {&core.haptic()}, {realtime, 0});
    loop.start();
    wait_until([] { return false; });
    loop.stop();
    fill_loop(figures, loop.stats());
  }
  client.stop();
  if (figures.joined) fill_link(figures, core, seen, monotonic_now() - begin);
  return figures;
}

namespace {

// Limits beyond which a link or a machine is reported as too bad, or as noticeable. A choice, not derived from a measurement.
constexpr double kLossMost = 0.3, kLossFelt = 0.1;
constexpr double kAgeMostMs = 1000, kAgeFeltMs = 300;
constexpr double kPauseMostMs = 500;   ///< pause without a patch after which the force has faded
constexpr double kSkippedMost = 0.01;  ///< share of the ticks
constexpr double kLateFelt = 0.05;     ///< share of the ticks that are late by more than 0.2 ms

class Judge {
 public:
  explicit Judge(const LinkFigures& figures) : f_(figures) {}

  LinkVerdict verdict() {
    v_.link_serves = v_.machine_serves = true;
    if (!f_.joined) {
      no(v_.link_serves, f_.refusal.empty() ? f_.no_answer : "refused: " + f_.refusal);
      return v_;
    }
    age();
    loss("to the server", f_.up, 0);
    if (f_.up.share > kLossMost)
      say(fmt::format("about {:.0f} of {:.0f} kbit/s get through to the server", (1 - f_.up.share) * f_.uplink_kbit_s,
                      f_.uplink_kbit_s));
    // About as many datagrams arrive per frame as the server sends, so a run of losses lasts that many frames.
    loss("from the server", f_.down, f_.datagrams_down_s > 0 ? 1e3 * f_.down.longest_run / f_.datagrams_down_s : 0);
    machine();
    settings();
    return v_;
  }

 private:
  void no(bool& serves, const std::string& why) {
    serves = false;
    v_.words.push_back("no: " + why);
  }
  void say(const std::string& word) { v_.words.push_back(word); }

  void age() {
    const double age_ms = f_.oldest_patch_ms();
    if (age_ms > kAgeMostMs)
      no(v_.link_serves,
         fmt::format("patches would be up to {:.0f} ms old; {:.0f} ms is the most that still helps", age_ms, kAgeMostMs));
    else if (age_ms > kAgeFeltMs)
      say(fmt::format("patches are up to {:.0f} ms old: the force of quick motion is less accurate; move slowly", age_ms));
  }

  void loss(const char* way, const LossFigures& loss, double pause_ms) {
    if (loss.share > kLossMost)
      no(v_.link_serves,
         fmt::format("{:.0f} % of the datagrams {} are lost; {:.0f} % is the most", 100 * loss.share, way, 100 * kLossMost));
    else if (loss.share > kLossFelt)
      say(fmt::format("{:.0f} % of the datagrams {} are lost: repeats cover it, at the price of older patches", 100 * loss.share,
                      way));
    if (pause_ms > kPauseMostMs)
      no(v_.link_serves, fmt::format("losses {} in runs of up to {} datagrams, {:.0f} ms: the force fades meanwhile", way,
                                     loss.longest_run, pause_ms));
  }

  void machine() {
    const auto all = static_cast<double>(f_.ticks + f_.skipped_ticks);
    if (f_.ticks == 0 || static_cast<double>(f_.skipped_ticks) > kSkippedMost * all)
      no(v_.machine_serves,
         fmt::format("this machine skips {} of {:.0f} haptic ticks: free a core, or grant real time (ulimit -r, "
                     "ulimit -l)",
                     f_.skipped_ticks, all));
    else if (static_cast<double>(f_.late_ticks) > kLateFelt * all)
      say(fmt::format("{} of {:.0f} haptic ticks are late by more than 0.2 ms: grant real time (ulimit -r, ulimit -l)",
                      f_.late_ticks, all));
  }

  /// Recommends settings: a frame should add less to the age than half the round trip, within the rates of servers.
  void settings() {
    if (!v_.link_serves) return;
    constexpr double kRateLeastHz = 20, kRateMostHz = 60;
    const double wanted_hz = std::clamp(std::round(2e3 / std::max(f_.rtt_p50_ms, 1.0) / 5) * 5, kRateLeastHz, kRateMostHz);
    say(f_.down.share > kNonlinearLossMost
            ? fmt::format("the server chooses scheme port on this link: hyper, which is more accurate, needs one that loses at "
                          "most {:.0f} %",
                          100 * kNonlinearLossMost)
            : std::string("the server chooses scheme hyper on this link while it has the time for it, otherwise port"));
    say(fmt::format("set: palpate-client --passivity {}", f_.oldest_patch_ms() > kAgeFeltMs ? "on" : "observe"));
    if (f_.rate_hz < 0.8 * wanted_hz)
      say(fmt::format(
          "set: palpate-server --rate-hz {:.0f} (now {:g}) would make patches {:.0f} ms younger, if its machine keeps up",
          wanted_hz, f_.rate_hz, f_.frame_ms() - 1e3 / wanted_hz));
  }

  const LinkFigures& f_;
  LinkVerdict v_;
};

}  // namespace

LinkVerdict judge(const LinkFigures& figures) { return Judge(figures).verdict(); }

std::string describe(const LinkFigures& f) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out,
                 "round trip   {:.1f} ms (median), {:.1f} ms (99 %), spread {:.1f} ms (99 % less the shortest), of {} measured\n"
                 "jitter       {:.1f} ms (change from one round trip to the next)\n",
                 f.rtt_p50_ms, f.rtt_p99_ms, f.spread_ms, f.round_trips, f.jitter_ms);
  fmt::format_to(out,
                 "lost         {:.1f} % up in runs of up to {}, {:.1f} % down in runs of up to {}; {} out of order, {} twice\n",
                 100 * f.up.share, f.up.longest_run, 100 * f.down.share, f.down.longest_run, f.reordered, f.duplicated);
  fmt::format_to(out, "traffic      {:.0f} kbit/s up, {:.0f} kbit/s down\n", f.uplink_kbit_s, f.downlink_kbit_s);
  fmt::format_to(out, "patch age    {:.0f} to {:.0f} ms expected at {:g} frames a second\n", f.youngest_patch_ms(),
                 f.oldest_patch_ms(), f.rate_hz);
  fmt::format_to(out, "haptic loop  {} ticks, {} late by more than 0.2 ms, {} skipped; {:.2f} ms late (99 %)", f.ticks,
                 f.late_ticks, f.skipped_ticks, f.lateness_p99_ms);
  return text;
}

}  // namespace palpate
