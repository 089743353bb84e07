#include "bench/world/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "bench/world/force_checks.hpp"
#include "bench/world/hash.hpp"
#include "bench/world/run_checks.hpp"
#include "bench/world/time_checks.hpp"
#include "client/device/replay_device.hpp"
#include "common/base/limits.hpp"
#include "common/base/sort_stably.hpp"
#include "common/wire/codec.hpp"

namespace palpate {
namespace {

/// A world with its checks.
class Run {
 public:
  Run(const Scenario& scenario, const RunOptions& options);
  WorldReport go();

 private:
  void add_stations();
  void add_checks();
  void judge();
  void plan(const Fault& fault);
  void heal();
  void die(std::size_t station, bool says_goodbye);
  void wake(std::size_t station);
  void rejoin(std::size_t station);
  void start_server(bool keep_body);
  template <class Do>
  void with_shadows(std::size_t station, const Do& act);
  void see(Micros now, const DatagramEvent& event);
  void see(Micros now, std::size_t station, const Vec3& position, const TickOutput& out);

  const Scenario& scenario_;
  const RunOptions& options_;
  std::vector<StationBounds> bounds_;
  World world_;
  Checks checks_;
  FadeCheck* fade_ = nullptr;
  PassivityCheck* passivity_ = nullptr;
  RecoveryCheck* recovery_ = nullptr;
  FreshnessCheck* freshness_ = nullptr;
  Hash hash_;
  WorldReport report_;
};

Run::Run(const Scenario& scenario, const RunOptions& options)
    : scenario_(scenario),
      options_(options),
      bounds_(bounds_of(scenario)),
      world_(scenario.scene, {.rate_hz = scenario.rate_hz,
                              .compute = scenario.compute,
                              .seed = scenario.drawn_with.seed,
                              .server_drift_ppm = scenario.server_drift_ppm,
                              .deadband = scenario.drawn_with.deadband,
                              .keys = options.keys,
                              .once = options.once}) {
  add_stations();
  if (options.check) add_checks();
  for (const Fault& fault : scenario_.faults) plan(fault);
  world_.at(scenario_.healed, [this] { heal(); });
  world_.run_frame = [this](Room& room, const FrameJob& job) {
    for (const auto& check : checks_) check->frame(world_.now());
    return options_.run_frame(room, job);
  };
  world_.on_datagram = [this](Micros now, const DatagramEvent& event) { see(now, event); };
}

void Run::add_stations() {
  for (std::size_t k = 0; k < scenario_.stations.size(); ++k) {
    const StationPlan& plan = scenario_.stations[k];
    if (plan.owner >= 0) {
      world_.add_shadow(plan.client, world_.station(static_cast<std::size_t>(plan.owner)), plan.up, plan.down);
    } else {
      Motion motion = plan.pushes() ? Motion(plan.path) : Motion::rest(home_of(scenario_.scene), 1);
      std::unique_ptr<MotionDevice> device;
      if (plan.simulated && plan.pushes())
        device = std::make_unique<SimPhantom>(std::move(motion), plan.phantom);
      else
        device = std::make_unique<ReplayDevice>(std::move(motion));
      world_.add_station(plan.client, std::move(device), plan.up, plan.down, plan.drift_ppm);
    }
    WorldStation& station = world_.station(k);
    if (!bounds_[k].feels) station.stall_haptic(true);  // a viewer has no hand
    station.on_tick = [this, k](Micros now, const Vec3& position, const TickOutput& out) { see(now, k, position, out); };
  }
}

void Run::add_checks() {
  const auto add = [this](auto check) {
    auto* raw = check.get();
    checks_.push_back(std::move(check));
    return raw;
  };
  add(std::make_unique<LimitsCheck>(bounds_));
  fade_ = add(std::make_unique<FadeCheck>(bounds_));
  passivity_ = add(std::make_unique<PassivityCheck>(bounds_));
  add(std::make_unique<CausalityCheck>(bounds_, world_, scenario_.compute));
  freshness_ = add(std::make_unique<FreshnessCheck>(bounds_, world_));
  add(std::make_unique<CountersCheck>(bounds_, world_));
  recovery_ = add(std::make_unique<RecoveryCheck>(bounds_, world_));
}

/// Applies `act` to a station and its shadows, which run in its process.
template <class Do>
void Run::with_shadows(std::size_t station, const Do& act) {
  act(station);
  for (std::size_t k = 0; k < scenario_.stations.size(); ++k)
    if (scenario_.stations[k].owner == static_cast<int>(station)) act(k);
}

void Run::die(std::size_t station, bool says_goodbye) {
  with_shadows(station, [&](std::size_t k) { says_goodbye ? world_.station(k).leave() : world_.station(k).crash(); });
}

void Run::wake(std::size_t station) {
  with_shadows(station, [&](std::size_t k) { world_.station(k).wake(world_.now()); });
}

void Run::rejoin(std::size_t station) {
  with_shadows(station, [&](std::size_t k) {
    if (world_.station(k).up()) return;
    world_.station(k).join_again(world_.now());
    if (!bounds_[k].feels) world_.station(k).stall_haptic(true);
    for (const auto& check : checks_) check->new_life(world_.now(), k);
  });
}

void Run::start_server(bool keep_body) {
  if (world_.server_up()) return;
  world_.start_server(keep_body);
  for (const auto& check : checks_) check->new_server(world_.now());
}

void Run::plan(const Fault& f) {
  const auto k = static_cast<std::size_t>(std::max(f.station, 0));
  const auto between = [&](std::function<void()> begin, std::function<void()> end) {
    world_.at(f.begin, std::move(begin));
    world_.at(f.end, std::move(end));
  };
  WorldStation& station = world_.station(k);
  const StationPlan& plan = scenario_.stations[k];
  switch (f.kind) {
    case FaultKind::cut_up:
      return between([&] { station.cut(true, false); }, [&] { station.cut(false, false); });
    case FaultKind::cut_down:
      return between([&] { station.cut(false, true); }, [&] { station.cut(false, false); });
    case FaultKind::cut:
      return between([&] { station.cut(true, true); }, [&] { station.cut(false, false); });
    case FaultKind::storm: {
      Links storm{plan.up, plan.down};
      for (LinkSpec* link : {&storm.up, &storm.down}) {
        link->loss = f.amount;
        link->burst_mean = 8;
        link->duplicate = link->reorder = 0.15;
      }
      return between([&station, storm] { station.change_link(storm.up, storm.down); },
                     [&station, &plan] { station.change_link(plan.up, plan.down); });
    }
    case FaultKind::path_change: {
      Links path{plan.up, plan.down};
      path.up.latency = path.down.latency = from_seconds(f.amount);
      return world_.at(f.begin, [&station, path] { station.change_link(path.up, path.down); });
    }
    case FaultKind::net_stall:
      return between([&] { station.stall_net(true); }, [&] { station.stall_net(false); });
    case FaultKind::haptic_stall:
      return between([&] { station.stall_haptic(true); }, [this, k] { world_.station(k).stall_haptic(!bounds_[k].feels); });
    case FaultKind::crash:
    case FaultKind::leave:
      return between([this, k, &f] { die(k, f.kind == FaultKind::leave); }, [this, k] { rejoin(k); });
    case FaultKind::clock_step:
      return world_.at(f.begin, [this, k, &f] {
        with_shadows(bounds_[k].owner, [&](std::size_t j) { world_.station(j).step_clock(from_seconds(f.amount)); });
      });
    case FaultKind::sleep:
      return between([this, k] { with_shadows(k, [&](std::size_t j) { world_.station(j).sleep(world_.now()); }); },
                     [this, k] { wake(k); });
    case FaultKind::server_stall:
      return between([this] { world_.stall_server(true); }, [this] { world_.stall_server(false); });
    case FaultKind::server_restart:
      return between([this] { world_.kill_server(); }, [this, &f] { start_server(f.amount > 0); });
    case FaultKind::server_clock_step:
      return world_.at(f.begin, [this, &f] { world_.step_server_clock(from_seconds(f.amount)); });
  }
}

void Run::heal() {
  world_.stall_server(false);
  start_server(true);
  for (std::size_t k = 0; k < world_.stations(); ++k) {
    WorldStation& station = world_.station(k);
    station.wake(world_.now());
    const Links links = healed_links(scenario_, k);
    station.change_link(links.up, links.down);
    station.cut(false, false);
    station.stall_net(false);
    station.stall_haptic(!bounds_[k].feels);
  }
  for (std::size_t k = 0; k < world_.stations(); ++k)
    if (scenario_.stations[k].owner < 0) rejoin(k);
}

void Run::see(Micros now, const DatagramEvent& event) {
  if (event.kind == DatagramEvent::Kind::sent) {
    ++report_.datagrams;
    hash_.add(static_cast<std::uint64_t>(now.count()));
    hash_.add(event.station * 2 + (event.to_server ? 1 : 0));
    hash_.add(event.bytes);
  }
  using Kind = DatagramEvent::Kind;
  const bool looked_into =
      event.kind == Kind::delivered || event.kind == Kind::brought || (event.kind == Kind::sent && !event.to_server);
  Message message;
  const bool read = looked_into && !checks_.empty() && decode(event.bytes, message) == WireFault::none;
  for (const auto& check : checks_) check->datagram(now, event, read ? &message : nullptr);
}

void Run::see(Micros now, std::size_t station, const Vec3& position, const TickOutput& out) {
  const ClientCore& core = world_.station(station).core();
  if (core.link() != LinkState::joined)
    bounds_[station].joined = Micros::max();
  else if (bounds_[station].joined == Micros::max())
    bounds_[station].joined = now;
  if (!(position.cwiseAbs().maxCoeff() <= kWorldExtentM))
    for (StationBounds& bounds : bounds_) bounds.outside |= bounds.owner == station;
  const SeenTick seen{now, world_.station(station).clock(now), station, position, out};
  for (const auto& check : checks_) check->tick(seen);
  hash_.add(static_cast<std::uint64_t>(now.count()));
  hash_.add(out.force);
  report_.trail.push_back(hash_.value());
  ++report_.ticks;
  if (options_.keep_rows)
    report_.rows.push_back({now, station, position, out.force, out.has_patch ? out.patch_age : Micros{-1}, out.contact});
}

void Run::judge() {
  for (const auto& check : checks_) {
    check->end(world_.now());
    for (const Violation& v : check->violations()) report_.violations.push_back(v);
    report_.judged.emplace_back(check->name(), check->judged());
  }
  sort_stably(report_.violations.begin(), report_.violations.end(),
              [](const Violation& a, const Violation& b) { return a.at < b.at; });
  report_.judged.emplace_back("return", fade_->returns());
  report_.oldest_calm = freshness_->oldest_calm();
  report_.energy_lowest_j = passivity_->lowest_j();
  report_.apart_worst_n = recovery_->worst_n();
}

WorldReport Run::go() {
  if (options_.prepare) options_.prepare(world_);
  world_.run_until(scenario_.end);
  if (options_.check) judge();
  report_.hash = hash_.value();
  report_.frames = world_.server().counts().frames;
  report_.frames_failed = world_.server().counts().frames_failed;
  for (std::size_t k = 0; k < world_.stations(); ++k) {
    report_.patches_used += world_.station(k).core().haptic().counts().patches_used;
    report_.joins += world_.station(k).core().counts().joins;
  }
  return std::move(report_);
}

}  // namespace

WorldReport run_scenario(const Scenario& scenario, const RunOptions& options) { return Run(scenario, options).go(); }

WorldReport run_twice(const Scenario& scenario, const RunOptions& options) {
  WorldReport first = run_scenario(scenario, options);
  const WorldReport second = run_scenario(scenario, options);
  if (first.hash == second.hash) return first;
  const auto [a, b] = std::mismatch(first.trail.begin(), first.trail.end(), second.trail.begin(), second.trail.end());
  const auto tick = static_cast<std::size_t>(a - first.trail.begin());
  first.violations.insert(first.violations.begin(),
                          {Micros{}, "repeat",
                           fmt::format("a second run of the same seed differs from tick {} of {} on; expected the same bits",
                                       tick, first.trail.size())});
  return first;
}

}  // namespace palpate
