// Every check can fail: each is run in a world in which only its rule is broken.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <optional>

#include "bench/world/force_checks.hpp"
#include "bench/world/run.hpp"
#include "bench/world/run_checks.hpp"
#include "bench/world/time_checks.hpp"
#include "client/device/replay_device.hpp"

using namespace palpate;

namespace {

/// A small world without faults: one hand with the given kind of device and the usual number of states, on a body that it touches
/// or holds.
Scenario quiet(bool simulated = false) {
  DrawOptions draw;
  draw.faults = draw.losses = draw.drift = false;
  draw.stations_max = 1;
  draw.duration_s = 1.5;
  for (;; ++draw.seed) {
    Scenario s = draw_scenario(draw);
    const auto& hello = s.stations[0].client.hello;
    if (s.stations[0].simulated == simulated && hello.scheme == Scheme::port && hello.order == 0 && s.end < Micros{4'000'000})
      return s;
  }
}

bool found(const WorldReport& report, const std::string& check) {
  for (const Violation& v : report.violations)
    if (v.check == check) return true;
  return false;
}

/// Runs the scenario with every tick's output changed.
WorldReport with_output(const Scenario& s, const std::function<void(const ToolSample&, TickOutput&)>& change) {
  RunOptions options;
  options.prepare = [&change](World& world) {
    world.station(0).run_tick = [&change](HapticTick& haptic, const ToolSample& sample) {
      TickOutput out = haptic.tick(sample);
      change(sample, out);
      return out;
    };
  };
  return run_scenario(s, options);
}

std::uint64_t judged(const WorldReport& report, const std::string& check) {
  for (const auto& [name, times] : report.judged)
    if (name == check) return times;
  return 0;
}

const std::vector<StationBounds> kOne(1);

}  // namespace

TEST_CASE("A world in which nothing is broken passes every check", "[checks]") {
  for (const bool simulated : {false, true}) {
    const WorldReport report = run_twice(quiet(simulated));
    for (const Violation& v : report.violations) FAIL_CHECK(v.check << ": " << v.what);
    CHECK(report.ticks > 2000);
    CHECK(report.patches_used > 10);
  }
}

TEST_CASE("The check of limits sees a force that is not finite, one beyond the peak, and one that jumps", "[checks]") {
  const Scenario s = quiet();
  const auto at_tick = [](int when, const auto& act) {
    return [when, act, tick = std::make_shared<int>(0)](const ToolSample&, TickOutput& out) {
      if (++*tick == when) act(out);
    };
  };
  CHECK(found(with_output(s, at_tick(500, [](TickOutput& out) { out.force.x() = std::nan(""); })), "limits"));
  CHECK(found(with_output(s, at_tick(500, [](TickOutput& out) { out.force *= 1e4 / (out.force.norm() + 1e-9); })), "limits"));
  CHECK(found(with_output(s, at_tick(1500, [](TickOutput& out) { out.force.x() += 2.5; })), "limits"));
}

TEST_CASE("The check of limits sees a guard that was told no limits", "[checks]") {
  Scenario s = quiet();
  s.stations[0].client.guard = {};
  for (MotionPoint& p : s.stations[0].path)
    if (p.t_s > 1 && p.t_s < 1.2) p.position.x() += 0.05;
  CHECK(found(run_scenario(s), "limits"));
}

TEST_CASE("The check of the fade sees a force that is held after its patch's validity", "[checks]") {
  Scenario s = quiet();
  s.healed += Micros{1'500'000};  // a patch is valid for two horizons and a quarter of a second
  s.faults.push_back({FaultKind::cut, 0, Micros{1'000'000}, s.healed, 0});
  CHECK_FALSE(found(run_scenario(s), "fade"));
  Vec3 held = Vec3(0, 0, 1);
  CHECK(found(with_output(s, [&](const ToolSample&, TickOutput& out) { out.force = held; }), "fade"));
}

TEST_CASE("The check of the fade sees a force that comes back at once, and one that fades for no reason", "[checks]") {
  Scenario s = quiet();
  s.healed = Micros{2'000'000};
  s.end += Micros{2'000'000};
  s.faults.push_back({FaultKind::cut, 0, Micros{1'000'000}, s.healed, 0});
  const auto whole = run_scenario(s);
  CHECK_FALSE(found(whole, "fade"));
  CHECK(judged(whole, "return") > 0);
  bool faded = false;
  CHECK(found(with_output(s,
                          [&](const ToolSample&, TickOutput& out) {
                            faded |= out.has_patch && out.patch_age > Micros{700'000} && out.force.norm() == 0;
                            if (faded && out.force.norm() > 0) out.force = Vec3(0, 0, 1.9);
                          }),
              "fade"));
  RunOptions brief;
  brief.prepare = [](World& world) {
    world.run_frame = [run = world.run_frame](Room& room, const FrameJob& job) {
      FrameResult result = run(room, job);
      for (StationFrame& frame : result.stations)
        if (frame.patch) frame.patch->valid_for = kTick;
      return result;
    };
  };
  CHECK(found(run_scenario(s, brief), "fade"));
}

TEST_CASE("The check of passivity sees a hand that is pushed along", "[checks]") {
  const Scenario s = quiet();
  Vec3 before = Vec3::Zero();
  bool has_before = false;
  const auto report = with_output(s, [&](const ToolSample& sample, TickOutput& out) {
    const Vec3 dx = has_before ? Vec3(sample.position - before) : Vec3::Zero();
    before = sample.position;
    has_before = true;
    if (dx.norm() > 0) out.force = dx / dx.norm();
  });
  CHECK(found(report, "passivity"));
}

TEST_CASE("The check of causality sees a patch of the future in use", "[checks]") {
  const auto report = with_output(quiet(), [](const ToolSample& sample, TickOutput& out) {
    if (out.has_patch) out.patch_stamp = sample.t + PatchIntake::kFutureMax + Micros{1};
  });
  CHECK(found(report, "causality"));
}

TEST_CASE("The check of causality sees a patch with a wrong stamp, and one from before it was sent", "[checks]") {
  Scenario s = quiet();
  s.stations[0].path.back().position.x() += 0.3;  // within a minute after the hand is done: 20 ms are 0.1 mm
  s.end += Micros{500'000};
  RunOptions options;
  options.prepare = [](World& world) {
    const auto run = world.run_frame;
    world.run_frame = [run](Room& room, const FrameJob& job) {
      FrameResult result = run(room, job);
      for (StationFrame& frame : result.stations)
        if (frame.patch) frame.patch->stamp -= Micros{20'000};
      return result;
    };
  };
  CHECK(found(run_scenario(s, options), "causality"));

  World world(s.scene, {});
  CausalityCheck check(kOne, world, {});
  check.datagram(Micros{1000}, {DatagramEvent::Kind::delivered, 7, 0, true, {}}, nullptr);
  CHECK(check.violations().size() == 1);
}

TEST_CASE("The check of causality sees a patch of a tool that has not been heard of for longer than the patch lasts",
          "[checks]") {
  const Scenario s = quiet();
  World world(s.scene, {});
  world.add_station({}, std::make_unique<ReplayDevice>(Motion::rest(Vec3::Zero(), 1)), {});
  CausalityCheck check(kOne, world, {});
  const Micros sampled{1'000'000}, sent{1'400'000};
  const auto pass = [&](Micros now, bool to_server, std::uint64_t number, Payload body) {
    Message message;
    message.clock.sent = to_server ? world.station(0).clock(now) : world.server_clock(now);
    message.body = std::move(body);
    check.datagram(now, {DatagramEvent::Kind::sent, number, 0, to_server, {}}, &message);
    check.datagram(now, {DatagramEvent::Kind::delivered, number, 0, to_server, {}}, &message);
  };
  const Micros own = world.station(0).clock(sampled);
  pass(sampled, true, 1, Samples{{{own, Vec3::Zero()}}});
  Patch patch;
  patch.valid_for = Micros{250'000};
  patch.stamp = own + patch.valid_for;
  pass(sent, false, 2, PatchMessage{patch});
  CHECK(check.violations().empty());
  patch.stamp += Micros{1};
  pass(sent, false, 3, PatchMessage{patch});
  CHECK(check.violations().size() == 1);
}

TEST_CASE("The check of freshness sees patches that come late, and a station that does not use the newest", "[checks]") {
  Scenario s = quiet();
  s.end += Micros{1'000'000};
  RunOptions slow;
  slow.prepare = [](World& world) {
    const auto run = world.run_frame;
    world.run_frame = [run, first = std::optional<Patch>{}](Room& room, const FrameJob& job) mutable {
      FrameResult result = run(room, job);
      for (StationFrame& frame : result.stations) {
        if (!first) first = frame.patch;
        frame.patch = first;
      }
      return result;
    };
  };
  CHECK(found(run_scenario(s, slow), "freshness"));
  const auto stuck = with_output(s, [first = Micros{}](const ToolSample&, TickOutput& out) mutable {
    if (!out.has_patch) return;
    if (first == Micros{}) first = out.patch_stamp;
    out.patch_stamp = first;
  });
  CHECK(found(stuck, "freshness"));
}

TEST_CASE("The check of recovery sees a link that was not healed, and a force that is not true", "[checks]") {
  Scenario s = quiet();
  RunOptions broken;
  broken.prepare = [&s](World& world) { world.at(s.healed + Micros{1}, [&world] { world.station(0).cut(true, true); }); };
  CHECK(found(run_scenario(s, broken), "recovery"));
  CHECK(found(with_output(s, [](const ToolSample&, TickOutput& out) { out.force *= 0.5; }), "recovery"));
}

TEST_CASE("The check of counters sees one that goes back", "[checks]") {
  Scenario s = quiet();
  World world(s.scene, {});
  CountersCheck check(kOne, world);
  std::vector<std::uint64_t> last;
  check.compare(Micros{1}, "hand", last, {3, 5});
  check.compare(Micros{2}, "hand", last, {3, 6});
  CHECK(check.violations().empty());
  check.compare(Micros{3}, "hand", last, {2, 7});
  REQUIRE(check.violations().size() == 1);
  CHECK(check.violations()[0].at == Micros{3});
}

TEST_CASE("Running twice sees whatever differs between two runs", "[checks]") {
  int runs = 0;
  RunOptions options;
  options.prepare = [&runs](World& world) {
    world.station(0).run_tick = [run = ++runs](HapticTick& haptic, const ToolSample& sample) {
      TickOutput out = haptic.tick(sample);
      out.force.x() += 1e-15 * run;
      return out;
    };
  };
  CHECK(found(run_twice(quiet(), options), "repeat"));
}
