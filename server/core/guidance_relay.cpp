#include "server/core/guidance_relay.hpp"

#include <algorithm>
#include <iterator>

namespace palpate {
namespace {

const Station* partner_of(const Stations& stations, const Station& station) {
  const auto partner = stations.find(station.guidance.partner);
  return partner != stations.end() ? &partner->second : nullptr;
}

bool guides(const Station& station) { return station.pushes() && !station.hello.guides.empty(); }

}  // namespace

/// Returns `ready` if the two can be a pair, else the reason why not.
GuidanceHand GuidanceRelay::obstacle(const Station& guide, const Station* partner) {
  if (!partner || !partner->pushes()) return GuidanceHand::absent;
  if (guides(*partner) || (partner->guidance.partner != 0 && partner->guidance.partner != guide.id)) return GuidanceHand::busy;
  return partner->guidance.report.hand == GuidanceHand::refuses ? GuidanceHand::refuses : GuidanceHand::ready;
}

void GuidanceRelay::tick(Stations& stations, Micros now) {
  std::erase_if(holds_, [&](const Hold& hold) {
    const bool gone = !stations.contains(hold.guide);
    if (gone) end(hold, now);
    return gone;
  });
  for (auto& [id, station] : stations) {
    if (station.guidance.partner == 0 || guides(station)) continue;
    const Station* const guide = partner_of(stations, station);
    if (!guide || guide->guidance.partner != id) station.guidance.partner = 0;
  }
  for (auto& [id, guide] : stations) {
    if (!guides(guide)) continue;
    Station* const partner = stations.named(guide.hello.guides);
    GuidanceSeat& seat = guide.guidance;
    const GuidanceHand before = seat.obstacle;
    seat.obstacle = obstacle(guide, partner);
    const bool pair = seat.obstacle == GuidanceHand::ready;
    if (!pair || seat.partner != partner->id) look(guide, nullptr, now);
    if (!pair && partner && partner->guidance.partner == id) partner->guidance.partner = 0;
    seat.partner = pair ? partner->id : 0;
    if (pair) partner->guidance.partner = id;
    if (!pair && (now >= seat.next || seat.obstacle != before)) {
      seat.due = true;
      seat.next = now + kReasonEvery;
    }
  }
}

void GuidanceRelay::heard_samples(Stations& stations, const Station& from, Micros now) const {
  const auto to = from.guidance.partner != 0 ? stations.find(from.guidance.partner) : stations.end();
  if (to == stations.end() || now < to->second.guidance.next) return;
  to->second.guidance.due = true;
  to->second.guidance.next = now + kRelayEvery;
}

void GuidanceRelay::heard_report(Stations& stations, Station& from, const GuidanceReport& report, Micros now) {
  from.guidance.report = report;
  const auto partner = from.guidance.partner != 0 ? stations.find(from.guidance.partner) : stations.end();
  if (partner == stations.end()) return;
  const bool leads = guides(from);
  look(leads ? from : partner->second, leads ? &partner->second : &from, now);
}

/// Notes whether a guide holds the tool of its partner, and the forces that both report; nullptr: it has no partner.
void GuidanceRelay::look(Station& guide, const Station* guided, Micros now) {
  const GuidanceReport& report = guide.guidance.report;
  const bool held = guided && report.hand == GuidanceHand::holds && guided->guidance.report.hand == GuidanceHand::holds;
  auto hold = std::ranges::find(holds_, guide.id, &Hold::guide);
  guide.guidance.held = held;
  if (!held && hold != holds_.end()) {
    end(*hold, now);
    holds_.erase(hold);
  }
  if (!held) return;
  if (hold == holds_.end()) {
    holds_.push_back({guide.id, guide.hello.station, guided->hello.station, now});
    hold = std::prev(holds_.end());
    if (on_guidance) on_guidance({hold->guide_name, hold->guided_name, true});
  }
  ++hold->reports;
  hold->guide_sum_n += report.force_n;
  hold->guided_sum_n += guided->guidance.report.force_n;
}

void GuidanceRelay::end(const Hold& hold, Micros now) const {
  if (!on_guidance) return;
  on_guidance({hold.guide_name, hold.guided_name, false, now - hold.since, hold.guide_sum_n / hold.reports,
               hold.guided_sum_n / hold.reports});
}

std::size_t GuidanceRelay::emit(const Stations& stations, Station& to, std::span<std::byte> out, Micros now) const {
  if (!to.guidance.due) return 0;
  to.guidance.due = false;
  Guidance message;
  message.guides = guides(to);
  if (const Station* const partner = partner_of(stations, to)) {
    const Timeline& timeline = partner->tool.timeline();
    if (timeline.empty()) return 0;
    message.partner = partner->hello.station;
    message.hand = partner->guidance.report.hand;
    message.reach = partner->guidance.report.reach;
    message.stamp = stations.station_time(to, timeline.newest());
    message.position = timeline.newest_position();
  } else {
    message.partner = to.hello.guides;
    message.hand = to.guidance.obstacle;
  }
  return message.partner.empty() ? 0 : encode_for(to, message, out, now);
}

}  // namespace palpate
