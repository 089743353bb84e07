// Motions of the hands for rollouts, from what they do now and what hands can do (docs/notebook/0026-where-hands-may-get-to.md):
//
//   dead_reckoned  as the tool's track goes on when nothing is heard (dead_reckoning.hpp)
//   else           x + v t + a (t e - e^2 / 2), e = min(t, kAccelerationS), with a = 0, with the hand's own acceleration, or with
//                  that and kHandMs2 along an axis beside it; after kPredictionMostS at rest, as no hand is known for longer
//
// in order of worth, and most bodies are touched from above: where there is time for few, the first are run. Within
// kPredictableS no hand gets far beside where it would get by itself.
#pragma once

#include <algorithm>
#include <array>

#include "server/reduce/tool_prediction.hpp"

namespace palpate {

struct HandRollout {
  bool dead_reckoned = false, accelerates = false;
  Vec3 beside_m_s2 = Vec3::Zero();
  int snapshots = 1;  ///< of the prediction horizon, evenly, the last at its end
  double weight = 1;  ///< of how far the body goes in it
};

inline constexpr double kAccelerationS = 0.05, kPredictionMostS = 0.25;
inline constexpr double kHandMostMs2 = 10;  ///< no hand speeds up more
inline constexpr double kPredictableS = 0.15;
inline constexpr std::size_t kRolloutsLeast = 2, kUndeviatedRollouts = 3;
inline constexpr int kRolloutSnapshots = 12;      ///< what swings within the prediction horizon is seen to
inline constexpr int kRoughRolloutSnapshots = 6;  ///< by rough steps, one each; of kRolloutSnapshots

inline const std::array<HandRollout, 6> kHandRollouts{{{.dead_reckoned = true, .snapshots = kRolloutSnapshots},
                                                       {.snapshots = kRolloutSnapshots},
                                                       {.accelerates = true, .snapshots = 2},
                                                       {.accelerates = true, .beside_m_s2 = {0, 0, kHandMs2}, .weight = 0.5},
                                                       {.accelerates = true, .beside_m_s2 = {kHandMs2, 0, 0}, .weight = 0.5},
                                                       {.accelerates = true, .beside_m_s2 = {0, kHandMs2, 0}, .weight = 0.5}}};

/// Where a hand is `after_s` from now.
inline ToolAt moved_on(const ToolAt& now, const Vec3& acceleration_m_s2, double after_s) {
  const double t = std::min(after_s, kPredictionMostS);
  const Vec3 velocity = now.velocity + std::min(t, kAccelerationS) * acceleration_m_s2;
  return {now.position + t * now.velocity + accelerated_displacement(acceleration_m_s2, t, kAccelerationS),
          after_s > kPredictionMostS ? Vec3(Vec3::Zero()) : velocity};
}

}  // namespace palpate
