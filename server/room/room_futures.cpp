// Where the body may be until the next patches: as its hands may move on, and as it was remembered or rehearsed.
#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <span>

#include "server/room/hand_futures.hpp"
#include "server/room/room_state.hpp"

namespace palpate {

/// The mean over the last 60 ms; none where it came since.
Vec3 Room::State::hand_acceleration(const Station& station) const {
  constexpr Micros kOver{30'000};
  const Micros now = from_seconds(body.time_s);
  if (now - 2 * kOver < station.track.begin()) return Vec3::Zero();
  const auto place = [&](Micros t) { return tool_at(station, t).position; };
  const Vec3 bend = place(now) - 2 * place(now - kOver) + place(now - 2 * kOver);
  const Vec3 acceleration = bend / (seconds(kOver) * seconds(kOver));
  return acceleration / std::max(1.0, acceleration.norm() / kHandMostMs2);
}

/// As far as the steps converge; whether that is to the end.
bool Room::State::step_in_thought(double over_s, const ToolMotion& tool, const std::function<void(int, const Vector&)>& look) {
  BodyState next = body;
  std::vector<ToolPort> there = ports;
  const int looks = roughly ? kRoughLooks : kLooksMost;
  for (int k = 1; k <= looks; ++k) {
    const double until_s = body.time_s + k * over_s / looks;
    if (!(roughly ? roughly->advance(next, there, until_s, tool, looks + 1 - k)
                  : integrator.stepper->advance(next, there, until_s, integrator.step_s, tool).converged))
      return false;
    look(k * (kLooksMost / looks), next.x);
  }
  return true;
}

/// In how many ways the hands may move on, of those in which a body is looked at in kMostS. Each costs what the body costs in the
/// bridged time, and a body that costs more than kMostCost of a core is left alone. Rough steps count what they took; a body of
/// which they would not get to the end of one way is left alone.
std::size_t Room::State::affordable_futures(Micros bridge) {
  constexpr double kMostCost = 0.01, kMostS = 0.0125;
  std::size_t futures = seconds(bridge) < kAlmostSureS ? kFuturesOfItself : kHandFutures.size();
  if (roughly) return roughly->allow(kMostS, kRoughLooks) ? futures : 0;
  if (integrator.cost > kMostCost) return 0;
  const double each_s = integrator.cost * seconds(bridge);
  while (futures > kFuturesLeast && static_cast<double>(futures) * each_s > kMostS) --futures;
  return futures;
}

/// None where the hands' likeliest way is not followed to its end: modes of where the body is before count for less than those
/// that they would take the place of.
std::vector<Vector> Room::State::as_hands_may_move(Micros bridge) {
  std::vector<ToolAt> now;
  std::vector<Vec3> acceleration;
  for (const StationId id : port_owner) {
    now.push_back(tool_at(stations.at(id), from_seconds(body.time_s)));
    acceleration.push_back(hand_acceleration(stations.at(id)));
  }
  std::vector<Vector> ahead;
  for (const HandFuture& future : std::span(kHandFutures).first(affordable_futures(bridge))) {
    const auto tool = [&](std::size_t k, double t) {
      if (future.coasts) return tool_at(stations.at(port_owner[k]), from_seconds(t));
      return moved_on(now[k], future.speeds_up ? Vec3(acceleration[k] + future.beside_m_s2) : Vec3(Vec3::Zero()),
                      t - body.time_s);
    };
    const bool to_its_end = step_in_thought(seconds(bridge), tool, [&](int look, const Vector& x) {
      if (look * future.looks % kLooksMost == 0) ahead.push_back(body.x + future.weight * (x - body.x));
    });
    if (future.coasts && !to_its_end) return {};
  }
  return ahead;
}

/// A sleeping body knows nothing of the hand that will wake it. Where one is near it is pressed as by a hand that speeds up, from
/// the surface to as deep as such a hand gets, once for every place. That costs what the body costs in kOverS; bodies that cost
/// more than kMostS for it are left alone.
void Room::State::rehearse(const std::vector<std::size_t>& feeling) {
  constexpr double kOverS = 0.25, kMostS = 0.04;
  constexpr std::size_t kMostPlaces = 16;
  if (integrator.cost * kOverS > kMostS) return;
  std::vector<Vec3> from, inwards(ports.size(), Vec3::Zero()), places;
  bool anew = false;
  for (std::size_t k = 0; k < ports.size(); ++k) from.push_back(frame_model.tool(k).position);
  for (const std::size_t k : feeling) {
    if (ports[k].kind == ContactKind::attach) continue;
    from[k] = position_at(skin.view(), frame_model.positions(), ports[k].point);
    inwards[k] = -normal_at(skin.view(), frame_model.positions(), ports[k].point);
    const Vec3& place = places.emplace_back(frame_model.place_of(ports[k]));
    if (std::any_of(rehearsed.begin(), rehearsed.end(), [&](const Vec3& known) { return remembered.alike(known, place); }))
      continue;
    anew = true;
    if (rehearsed.size() == kMostPlaces) rehearsed.pop_front();
    rehearsed.push_back(place);
  }
  if (!anew) return;
  const auto tool = [&](std::size_t k, double t) {
    const double after_s = t - body.time_s;
    return ToolAt{from[k] + sped_up(after_s) * inwards[k], speed_of_speeding_up(after_s) * inwards[k]};
  };
  step_in_thought(kOverS, tool, [&](int, const Vector& x) { remembered.keep(places, x); });
}

/// A basis that knows where the body may be is truer there. What is remembered is less likely to come back than what is looked at
/// ahead is to come, and counts for less, in finely meshed bodies above all. Bodies that are stepped roughly, solids mostly, gain
/// nothing by what is remembered.
void Room::State::look_ahead(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros bridge) {
  constexpr double kRemembered = 0.06, kBesideFutures = 0.03;
  std::vector<std::size_t> feeling;
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    if (!gets_patch[k] || job.stations[k].scheme != Scheme::hyper) continue;
    const std::size_t which = *port_of(job.stations[k]);
    if (!kept_for(job.stations[k], which)) feeling.push_back(which);
  }
  if (feeling.empty() || !job.rollouts) return;
  std::vector<Vector> going_on, others;
  if (!asleep) going_on = as_hands_may_move(bridge);
  const double weight = going_on.empty() ? kRemembered : kBesideFutures;
  if (const std::size_t looks = roughly ? kRoughLooks : kLooksMost; going_on.size() > looks) {
    const auto end = going_on.begin() + static_cast<std::ptrdiff_t>(looks);
    others.assign(std::make_move_iterator(end), std::make_move_iterator(going_on.end()));
    going_on.erase(end, going_on.end());
  }
  if (roughly) {
    frame_model.foresee(std::move(going_on), std::move(others));
    return;
  }
  if (asleep) rehearse(feeling);
  std::vector<Vec3> near, holding;
  for (const std::size_t k : feeling) near.push_back(frame_model.place_of(ports[k]));
  for (const Vector* x : remembered.telling(near, body.x)) others.push_back(body.x + weight * (*x - body.x));
  for (const ToolPort& port : ports)
    if (port.kind == ContactKind::attach || port.touching) holding.push_back(frame_model.place_of(port));
  if (!holding.empty()) remembered.keep(holding, body.x);
  frame_model.foresee(std::move(going_on), std::move(others));
}

}  // namespace palpate
