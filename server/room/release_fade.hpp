// Release of a tool, because the body was reset or because the tool cost more computation than one hand may. The force F_0 that
// the hand felt then, at t_0, fades along the minimum-jerk curve m (minimum_jerk.hpp), whatever the tool does meanwhile:
//     F(t) = (1 - m((t - t_0) / T)) F_0,   T = kFadeTime
// Afterwards, and not before `off` has passed, the tool may touch again, but only from outside: from inside it would tear the
// body open.
#pragma once

#include "common/base/minimum_jerk.hpp"
#include "server/body/skin.hpp"

namespace palpate {

struct ReleaseFade {
  static constexpr Micros kFadeTime{300'000};  ///< a force changes by at most 0.6 % of itself per tick

  Micros since{};
  Vec3 force = Vec3::Zero();  ///< on the tool at `since` [N]
  Micros off = kFadeTime;

  Vec3 felt(Micros t) const { return (1 - minimum_jerk(seconds(t - since) / seconds(kFadeTime))) * force; }
  /// Returns true if a tool at `tool` may grasp or touch a body at `x` from now on.
  bool over(Micros now, ContactKind contact, const Skin& skin, const Vector& x, const Vec3& tool) const {
    if (now < since + off) return false;
    return contact == ContactKind::attach || skin.empty() || nearest_point(skin.view(), skin.place(x), tool).height_m > 0;
  }
};

}  // namespace palpate
