#include "server/core/scheme_choice.hpp"

#include <algorithm>

namespace palpate {

Micros SchemeChoice::has(const SchemeCost& cost) {
  const Micros most = from_seconds(kShareOfFrame * seconds(cost.frame));
  return std::max(Micros{}, most - cost.body - cost.others) / std::max(1, cost.stations);
}

/// `fits`, or nothing known, where there is none within `share` of what there is.
SchemeReason SchemeChoice::objection(const SchemeCost& cost, double lost, double share) const {
  if (lost > share * kLostMost) return SchemeReason::link_lossy;
  if (cost.nonlinear == Micros{}) return SchemeReason::not_known_yet;
  if (seconds(cost.nonlinear) > share * seconds(has(cost))) return SchemeReason::server_busy;
  return SchemeReason::fits;
}

void SchemeChoice::change(bool nonlinear, Micros now) {
  if (!nonlinear)
    comes_back_after_ = now - changed_ < kStayed ? std::min(2 * comes_back_after_, kComesBackAfterMost) : kComesBackAfter;
  nonlinear_ = nonlinear;
  changed_ = now;
  ++changes_;
}

bool SchemeChoice::decide(const SchemeCost& cost, double lost, Micros now) {
  const SchemeReason bad = objection(cost, lost, nonlinear_ || !began_ ? 1.0 : kComesBackBelow);
  const bool fits = bad == SchemeReason::fits || bad == SchemeReason::not_known_yet;
  if (!began_) {
    began_ = true;
    nonlinear_ = fits;
    reason_ = bad;
    changed_ = now;
    return nonlinear_;
  }
  if (nonlinear_) {
    if (!fits) change(false, now);
    reason_ = bad;
    objected_ = !fits;
    return nonlinear_;
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
