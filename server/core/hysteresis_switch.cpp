#include "server/core/hysteresis_switch.hpp"

#include <algorithm>

namespace palpate {

Micros HysteresisSwitch::left(const DetailCost& cost) {
  return std::max(Micros{}, cost.time - cost.body - cost.others) / std::max(1, cost.shares);
}

/// Returns the reason against the option within `share` of the available time and loss, or else `fits` or `not_known_yet`.
SchemeReason HysteresisSwitch::objection(const DetailCost& cost, double lost, double share) const {
  if (lost > share * kNonlinearLossMost) return SchemeReason::link_lossy;
  if (cost.cost == Micros{}) return SchemeReason::not_known_yet;
  if (seconds(cost.cost) > share * seconds(left(cost))) return SchemeReason::server_busy;
  return SchemeReason::fits;
}

void HysteresisSwitch::change(bool taken, Micros now) {
  if (!taken)
    comes_back_after_ =
        changes_ > 0 && now - changed_ < kStayed ? std::min(2 * comes_back_after_, kComesBackAfterMost) : kComesBackAfter;
  taken_ = taken;
  changed_ = now;
  ++changes_;
}

bool HysteresisSwitch::decide(const DetailCost& cost, double lost, Micros now) {
  const SchemeReason bad = objection(cost, lost, taken_ || !began_ ? 1.0 : kComesBackBelow);
  const bool fits = bad == SchemeReason::fits || bad == SchemeReason::not_known_yet;
  if (!began_) {
    began_ = true;
    taken_ = fits;
    reason_ = bad;
    changed_ = now;
    return taken_;
  }
  if (taken_) {
    if (!fits) change(false, now);
    reason_ = bad;
    objected_ = !fits;
    return taken_;
  }
  if (!fits) {
    objected_ = true;
    reason_ = bad;
    return false;
  }
  if (objected_) fits_since_ = now;
  objected_ = false;
  if (now - fits_since_ < comes_back_after_) return false;
  change(true, now);
  reason_ = bad;
  return true;
}

}  // namespace palpate
