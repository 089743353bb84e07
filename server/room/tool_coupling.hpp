// Grasp and release of a body by a tool, without a step in the path of the body or in the force on the hand: both fade along the
// minimum-jerk curve m (minimum_jerk.hpp).
//
// A grasp begins at t_0 with its node d = x_node - x_tool away from the tool, and removes this difference within kGraspTime:
//     x_node(t) = x_tool(t) + (1 - m((t - t_0) / kGraspTime)) d
// A tool further than kGraspReachM from its node does not grasp it: a hand that returns from elsewhere would be pulled, and the
// body with it.
//
// A tool is released because the body was reset or because the tool cost more computation than one hand may. The force F_0 that
// the hand felt then, at t_0, fades, whatever the tool does meanwhile:
//     F(t) = (1 - m((t - t_0) / kFadeTime)) F_0
// Afterwards, and not before `off` has passed, the tool may touch again, but only from outside: from inside it would tear the
// body open.
#pragma once

#include "common/base/grasp_reach.hpp"
#include "common/base/minimum_jerk.hpp"
#include "server/body/skin.hpp"

namespace palpate {

inline constexpr Micros kGraspTime{500'000};  ///< for a distance of at most kGraspReachM: the node moves at 0.19 m/s at most

struct ReleaseFade {
  static constexpr Micros kFadeTime{300'000};  ///< a force changes by at most 0.6 % of itself per tick

  FadingVector force;  ///< on the tool [N]
  Micros off = kFadeTime;

  ReleaseFade(Micros since, const Vec3& force_n, Micros for_at_least = kFadeTime)
      : force{since, kFadeTime, force_n}, off(for_at_least) {}
  /// Returns true if a tool at `tool` may grasp or touch a body at `x` from now on.
  bool over(Micros now, ContactKind contact, const Skin& skin, const Vector& x, const Vec3& tool) const {
    if (now < force.begin + off) return false;
    return contact == ContactKind::attach || skin.empty() || nearest_point(skin.view(), skin.place(x), tool).height_m > 0;
  }
};

}  // namespace palpate
