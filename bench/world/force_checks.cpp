#include "bench/world/force_checks.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace palpate {
namespace {

constexpr double kRounding = 1e-9;   // relative
constexpr Micros kSkipped{1'500};    // two ticks further apart have skipped one
constexpr double kNothingN = 1e-12;  // zero, up to the rounding of a clamp

}  // namespace

void LimitsCheck::tick(const SeenTick& seen) {
  const StationBounds& bounds = bounds_[seen.station];
  const Vec3& f = seen.out.force;
  const auto& last = last_[seen.station];
  if (!f.allFinite())
    fail(seen.now, fmt::format("{} feels ({}, {}, {}) N; expected finite numbers", bounds.name, f.x(), f.y(), f.z()));
  else if (f.norm() > bounds.limits.force_max_n * (1 + kRounding))
    fail(seen.now,
         fmt::format("{} feels {:.6g} N; the device's peak is {:g} N", bounds.name, f.norm(), bounds.limits.force_max_n));
  else if (last && seen.own > last->own) {
    judge();
    const double most = bounds.limits.slew_max_n_s * seconds(seen.own - last->own);
    const double change = (f - last->out.force).norm();
    if (change > most * (1 + kRounding))
      fail(seen.now, fmt::format("the force of {} changes by {:.6g} N in {} us; its device takes {:.6g} N", bounds.name, change,
                                 (seen.own - last->own).count(), most));
  }
  last_[seen.station] = seen;
}

void FadeCheck::datagram(Micros, const DatagramEvent& event, const Message* message) {
  const bool came = event.kind == DatagramEvent::Kind::delivered || event.kind == DatagramEvent::Kind::brought;
  if (!came || event.to_server || !message) return;
  Station& s = seen_[event.station];
  // A datagram brought late by an attacker says nothing about the present.
  const auto is_newest = [&](Micros said) {
    if (said < s.newest_said) return false;
    s.newest_said = said;
    return true;
  };
  if (const auto* beat = std::get_if<Beat>(&message->body)) {
    if (is_newest(beat->body_time)) s.in_reach = beat->contact_in_reach;
    if (beat->renewed_from != 0) s.valid_for[beat->body_time] = s.newest_valid_for;
  }
  const auto* patch = std::get_if<PatchMessage>(&message->body);
  if (!patch) return;
  s.valid_for[patch->patch.stamp] = patch->patch.valid_for;
  if (!is_newest(patch->patch.stamp)) return;
  s.in_reach = true;
  s.newest_valid_for = patch->patch.valid_for;
}

void FadeCheck::tick(const SeenTick& seen) {
  Station& s = seen_[seen.station];
  const std::string& name = bounds_[seen.station].name;
  const double force_n = seen.out.force.norm();
  if (!seen.out.has_patch) {
    if (force_n > kNothingN) fail(seen.now, fmt::format("{} feels {:.6g} N without a patch; expected none", name, force_n));
    return;
  }
  const auto patch = s.valid_for.find(seen.out.patch_stamp);
  if (patch == s.valid_for.end())
    return fail(seen.now, fmt::format("{} uses a patch stamped {} us that never came", name, seen.out.patch_stamp.count()));
  s.valid_for.erase(s.valid_for.begin(), patch);
  const bool was_faded = s.expired_ticks > kFade;
  s.expired_ticks = seen.out.patch_age > patch->second ? s.expired_ticks + kTick : Micros{};
  if (s.expired_ticks > kFade) {
    judge();
    if (force_n > kNothingN)
      fail(seen.now, fmt::format("{} feels {:.6g} N {} ms after the validity of its patch ended; expected none", name, force_n,
                                 s.expired_ticks / kTick));
  }
  const StationBounds& bounds = bounds_[seen.station];
  s.needless_ticks = s.in_reach && s.expired_ticks > Micros{} ? s.needless_ticks + 1 : 0;
  if (s.needless_ticks > kWakeTicks && seen.now >= bounds.healed && bounds.calm(seen.now))
    fail(seen.now, fmt::format("the force of {} fades over a link that loses nothing: its patch is {} us old and valid for {} us",
                               name, seen.out.patch_age.count(), patch->second.count()));
  check_return(seen, s, was_faded);
}

/// A tool that is free in a fresh patch meets the body later, and feels that at once.
void FadeCheck::check_return(const SeenTick& seen, Station& s, bool was_faded) {
  const double force_n = seen.out.force.norm();
  if (s.expired_ticks > Micros{}) {
    s.since_return = kReturnTicks;
    return;
  }
  if (was_faded && force_n > kNothingN) {
    s.since_return = 0;
    ++returns_;
  }
  if (s.since_return >= kReturnTicks) return;
  ++s.since_return;
  const double most_n = 2 * bounds_[seen.station].limits.force_max_n * s.since_return / kReturnTicks;
  if (force_n > most_n * (1 + kRounding))
    fail(seen.now, fmt::format("the force of {} comes back with {:.6g} N in its tick {}; expected at most {:.6g} N",
                               bounds_[seen.station].name, force_n, s.since_return, most_n));
}

void PassivityCheck::tick(const SeenTick& seen) {
  constexpr double kRestN = 1e-6;
  if (!bounds_[seen.station].pushes) return;
  Station& s = seen_[seen.station];
  s.rest_ticks = seen.out.force.norm() < kRestN ? s.rest_ticks + 1 : 0;
  if (s.last && seen.own - s.last->own < kSkipped)
    energy_j_ -= 0.5 * (s.last->out.force + seen.out.force).dot(seen.position - s.last->position);
  if (s.last && energy_j_ < 0) energy_j_ = std::min(energy_j_ + kBudgetW * seconds(seen.own - s.last->own), 0.0);
  s.last = seen;
  const auto rests = [&](std::size_t k) { return !bounds_[k].pushes || seen_[k].rest_ticks >= kRestTicks; };
  bool all_rest = true, all_port = true;
  for (std::size_t k = 0; k < bounds_.size(); ++k) {
    all_rest &= rests(k);
    all_port &= !bounds_[k].pushes || bounds_[k].port;
  }
  if (all_rest) energy_j_ = 0;
  if (!all_port || !bounds_[seen.station].unmoved) return;
  judge();
  lowest_j_ = std::min(lowest_j_, energy_j_);
  if (energy_j_ < -kBudgetJ)
    fail(seen.now, fmt::format("the hands have got {:.3g} mJ more than they put in, {} the last; the budget is {:g} mJ",
                               -1e3 * energy_j_, bounds_[seen.station].name, 1e3 * kBudgetJ));
}

}  // namespace palpate
