// A tool that was let go of because the body was put back to rest, or as it cost more than one hand may. What the hand felt then,
// F_0 at t_0, fades along the curve m of least jerk (minimum_jerk.hpp), whatever the tool does meanwhile:
//     F(t) = (1 - m((t - t_0) / T)) F_0,   T = kFadeTime
// Afterwards, and not before `off` has passed, the tool may touch again, but not from inside of the body, which it would tear
// open: it has to come from outside.
#pragma once

#include "common/base/minimum_jerk.hpp"
#include "server/body/skin.hpp"

namespace palpate {

struct LetGo {
  static constexpr Micros kFadeTime{300'000};  ///< a force changes by 0.6 % of itself in a tick at most

  Micros since{};
  Vec3 force = Vec3::Zero();  ///< on the tool then [N]
  Micros off = kFadeTime;

  Vec3 felt(Micros t) const { return (1 - minimum_jerk(seconds(t - since) / seconds(kFadeTime))) * force; }
  /// Whether a tool at `tool` may take hold of, or touch, a body at `x` from now on.
  bool over(Micros now, ContactKind contact, const Skin& skin, const Vector& x, const Vec3& tool) const {
    if (now < since + off) return false;
    return contact == ContactKind::attach || skin.empty() || nearest_point(skin.view(), skin.place(x), tool).height_m > 0;
  }
};

}  // namespace palpate
