#include "client/core/guidance.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

void GuidanceCoupling::hear(const PartnerTool& partner, Micros now) noexcept {
  const bool usable = partner.position.allFinite() && partner.position.cwiseAbs().maxCoeff() <= kWorldExtentM;
  partner_.willing = partner.willing;
  if (!partner.willing || !usable || (any_ && partner.stamp < partner_.stamp && heard_ + kSilence > now)) return;
  if (!any_) target_ = partner.position;
  partner_ = partner;
  heard_ = now;
  any_ = true;
}

/// Returns true while the samples are fresh and the partner does not object.
bool GuidanceCoupling::may_hold(Micros now) const noexcept {
  return any_ && partner_.willing && now - heard_ <= kSilence && now - partner_.stamp <= kDelayMost;
}

/// Advances y and v.
void GuidanceCoupling::follow(const Vec3& own, double dt_s) noexcept {
  const Vec3 velocity = moves_ ? Vec3((own - before_) / dt_s) : Vec3(Vec3::Zero());
  before_ = own;
  moves_ = true;
  velocity_ += dt_s / (kVelocityS + dt_s) * (velocity - velocity_);
  const Vec3 way = dt_s / (kTargetS + dt_s) * (partner_.position - target_);
  const double most_m = kTargetMostMS * dt_s, way_m = way.norm();
  target_ += way_m > most_m ? Vec3(most_m / way_m * way) : way;
}

/// Notes the delay of y. The sum in use grows no faster than kRoundSlope, so that K makes no step.
void GuidanceCoupling::note_delay(Micros now, double dt_s) noexcept {
  reach_s_ = std::max(reach_s_, std::max(0.0, seconds(now - partner_.stamp)) + kTargetS + kTickS);
  const double sum_s = reach_s_ + seconds(partner_.reach);
  round_s_ = gain_ > 0 ? std::max(round_s_, std::min(sum_s, round_s_ + kRoundSlope * dt_s)) : sum_s;
}

/// Decides whether the hand broke away, or has come back.
void GuidanceCoupling::watch_pull(double pull_n, double apart_m, double dt_s) noexcept {
  pulled_s_ = gain_ >= 1 && pull_n >= kForceMostN ? pulled_s_ + dt_s : 0;
  met_s_ = released_ && apart_m <= kMeetM ? met_s_ + dt_s : 0;
  released_ = released_ ? met_s_ < kMeetS : pulled_s_ >= kPullS;
}

Vec3 GuidanceCoupling::tick(const ToolSample& own, double dt_s) noexcept {
  if (idle()) return Vec3::Zero();
  const bool fresh = may_hold(own.t);
  if (!fresh && gain_ <= 0) {
    restart();
    return Vec3::Zero();
  }
  follow(own.position, dt_s);
  if (fresh) note_delay(own.t, dt_s);
  const double stiffness = stiffness_for(round_s_);
  const Vec3 apart = target_ - own.position;
  const double apart_m = apart.norm(), pull_n = stiffness * apart_m;
  if (fresh) watch_pull(pull_n, apart_m, dt_s);
  const bool holds = fresh && !released_ && partner_.reach > Micros{};
  gain_ = std::clamp(gain_ + (holds ? dt_s / kFadeInS : -dt_s / kFadeOutS), 0.0, 1.0);
  const Vec3 spring = pull_n > kForceMostN ? Vec3(kForceMostN / apart_m * apart) : Vec3(stiffness * apart);
  return gain_ * (spring - 0.5 * stiffness * round_s_ * velocity_);
}

void GuidanceCoupling::restart() noexcept {
  const bool released = released_;
  *this = {};
  released_ = released;
}

}  // namespace palpate
