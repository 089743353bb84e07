#include "server/core/frame_budget.hpp"

#include <algorithm>
#include <vector>

#include "common/base/sort_stably.hpp"

namespace palpate {

void FrameBudget::choose(Stations& stations, Micros now) {
  choose_schemes(stations, now);
  choose_rollouts(stations, now);
  choose_served(stations, now);
}

void FrameBudget::choose_schemes(Stations& stations, Micros now) {
  DetailCost cost{from_seconds(kSchemesMayTake * frame_s_), costs_.step(), Micros{}, costs_.nonlinear(), 0};
  for (const auto& [id, station] : stations) {
    if (station.chosen()) ++cost.shares;
    if (station.pushes() && !station.chosen()) cost.others += patch_cost(*station.hello.scheme);  // shadows get the rest
  }
  for (auto& [id, station] : stations)
    if (!station.views()) choose_scheme(station, cost, now);
}

void FrameBudget::choose_scheme(Station& station, const DetailCost& cost, Micros now) {
  const SchemeInUse before = station.in_use;
  if (station.hello.scheme) {
    station.in_use = {*station.hello.scheme, SchemeReason::asked, Micros{}, Micros{}};
    return;
  }
  const bool nonlinear = station.choice.decide(cost, station.link.lost, now);
  station.in_use = {nonlinear ? Scheme::hyper : Scheme::port, station.choice.reason(), cost.cost, HysteresisSwitch::left(cost)};
  const bool was_known = before.reason > SchemeReason::not_known_yet,
             known = station.choice.reason() > SchemeReason::not_known_yet;
  if (on_scheme && known && (!was_known || before.scheme != station.in_use.scheme))
    on_scheme(station.hello.station, station.in_use);
}

void FrameBudget::choose_rollouts(Stations& stations, Micros now) {
  DetailCost cost{from_seconds(kRolloutsMayTake * frame_s_), costs_.step(), Micros{}, costs_.rollouts(), 1};
  for (const auto& [id, station] : stations)
    if (!station.views()) cost.others += patch_cost(station.in_use.scheme);
  rollouts_.decide(cost, 0, now);
  for (auto& [id, station] : stations)
    if (station.chosen() && station.in_use.reason == SchemeReason::fits && !rollouts_.taken())
      station.in_use.reason = SchemeReason::fits_without_rollouts;
}

Micros FrameBudget::expected_cost(const Station& station, Micros now) const {
  const bool touches = station.touched && now - *station.touched < kTouchKept;
  const Micros cost = station.in_use.scheme == Scheme::hyper ? costs_.nonlinear_so_far() : costs_.linear_so_far();
  return touches ? cost : cost / kMayTouch;
}

void FrameBudget::choose_served(Stations& stations, Micros now) {
  std::vector<Station*> order;
  for (const bool pushes : {true, false})
    for (auto& [id, station] : stations)
      if (!station.views() && station.pushes() == pushes) order.push_back(&station);
  const Micros time =
      std::max(from_seconds(kSchemesMayTake * frame_s_) - costs_.step(), from_seconds(kPatchesMayTake * frame_s_));
  Micros spent{};
  const auto serve_within = [&](Station& station, Micros most) {
    const Micros cost = expected_cost(station, now);
    station.served = cost == Micros{} || spent + cost <= most;
    if (!station.served) return;
    spent += cost;
    station.served_at = now;
  };
  auto next = order.begin();
  for (; next != order.end(); ++next) {
    serve_within(**next, next == order.begin() ? Micros::max() : time / 2);
    if (!(*next)->served) break;
  }
  sort_stably(next, order.end(), [](const Station* a, const Station* b) { return a->served_at < b->served_at; });
  std::for_each(next, order.end(), [&](Station* station) { serve_within(*station, time); });
  if (next == order.end() || (*next)->served || now < next_turn_) return;
  next_turn_ = now + kTurnEvery * expected_cost(**next, now);
  serve_within(**next, Micros::max());
}

/// Patches count by the scheme that was asked for: where a nonlinear patch failed, the attempt took the time. A body that is
/// reset built none.
bool FrameBudget::learn(const FrameResult& result, const Stations& stations, Micros passed) {
  if (result.failed || result.asleep || result.step_took == Micros{}) return false;
  costs_.take_step(result.step_took);
  FrameCosts::Patches patches{result.patches_took, result.rollouts_took, 0, 0};
  for (const StationFrame& frame : result.stations) {
    const auto station = stations.find(frame.id);
    if (!frame.patch || station == stations.end()) continue;
    const Scheme asked = station->second.in_use.scheme;
    if (frame.patch->scheme == Scheme::hold && asked != Scheme::hold) return false;
    ++(asked == Scheme::hyper ? patches.nonlinear : patches.linear);
  }
  if (patches.nonlinear == 0) patches.rollouts = {};
  costs_.take_patches(patches, passed);
  return patches.nonlinear > 0 && !rollouts_.taken();
}

}  // namespace palpate
