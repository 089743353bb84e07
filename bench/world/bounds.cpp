// Derives bounds on the stations from a scenario.
#include <algorithm>
#include <limits>

#include "bench/world/run.hpp"
#include "client/core/uplink_pace.hpp"

namespace palpate {
namespace {

constexpr double kDriftSlack = 1e-3;  // larger than any drift
constexpr int kTrueOrder = 12;        // with fewer states a light hand on a soft block may keep bouncing

/// Interval between two patches: frames that fall due while one is computed are skipped.
Micros frame_spacing(const Scenario& s) {
  const Micros frame = from_seconds(1 / s.rate_hz);
  return (1 + s.compute / frame) * frame;
}

/// A patch contains the samples of the slowest punctual station, is computed after a frame at most one spacing later, and may
/// then wait for the next one if no newer sample came.
Micros sent_age_max(const Scenario& s) {
  Micros slowest_up{};
  for (std::size_t k = 0; k < s.stations.size(); ++k)
    if (s.stations[k].pushes()) slowest_up = std::max(slowest_up, slowest_ever(s, k, true) + UplinkPace::kCalm);
  const Micros age = slowest_up + kLateAfter + 2 * frame_spacing(s) + s.compute + 2 * kTick;
  return age + from_seconds(kDriftSlack * seconds(age));
}

std::vector<std::pair<Micros, Micros>> disturbances(const Scenario& s, std::size_t station) {
  const Micros recovery = recovery_time(s, station);
  std::vector<std::pair<Micros, Micros>> times;
  const StationPlan& plan = s.stations[station];
  const auto shares_clock = [&](const Fault& f) {
    return f.kind == FaultKind::clock_step && s.stations[static_cast<std::size_t>(f.station)].owner == static_cast<int>(station);
  };
  for (const Fault& f : s.faults) {
    if (misjudged_for(s, f) > Micros{}) times.emplace_back(f.begin, f.end + misjudged_for(s, f) + recovery);
    if (f.station < 0 || f.station == static_cast<int>(station) || f.station == plan.owner || shares_clock(f))
      times.emplace_back(f.begin, f.end + recovery);
  }
  times.emplace_back(s.healed, s.healed + recovery);  // effects of a fault may end here
  return times;
}

}  // namespace

std::vector<StationBounds> bounds_of(const Scenario& s) {
  std::vector<StationBounds> all;
  const SimPhantomOptions device;
  const auto count = [&](auto what) { return std::count_if(s.stations.begin(), s.stations.end(), what); };
  const bool one = count([](const StationPlan& plan) { return plan.pushes(); }) <= 1;
  const bool rigid = count([](const StationPlan& plan) { return plan.pushes() && plan.simulated; }) == 0;
  for (std::size_t k = 0; k < s.stations.size(); ++k) {
    const StationPlan& plan = s.stations[k];
    StationBounds b;
    b.name = plan.client.hello.station;
    b.feels = plan.client.hello.role == Role::haptic;
    b.pushes = plan.pushes();
    b.port = plan.client.hello.scheme == Scheme::port;
    b.true_at_rest = plan.client.hello.order == 0 || plan.client.hello.order >= kTrueOrder;
    const StationPlan& hand = plan.owner >= 0 ? s.stations[static_cast<std::size_t>(plan.owner)] : plan;
    b.lets_go = hand.simulated && hand.phantom.release_s < std::numeric_limits<double>::infinity();
    b.unmoved = one || rigid;
    b.owner = plan.owner >= 0 ? static_cast<std::size_t>(plan.owner) : k;
    b.limits = {device.force_max_n, SimPhantom::kSlewMaxNS, PassivityMode::on};
    b.future_max = plan.owner >= 0 ? PatchIntake::kShadowFutureMax : PatchIntake::kFutureMax;
    b.sent_age_max = sent_age_max(s);
    b.down_max = slowest_ever(s, k, false);
    b.frames = frame_spacing(s);
    b.healed = s.healed;
    b.recovered = recovered_by(s, k);
    b.at_rest = std::max(s.rest, b.recovered) + kComesToRest;
    b.disturbed = disturbances(s, k);
    all.push_back(std::move(b));
  }
  return all;
}

}  // namespace palpate
