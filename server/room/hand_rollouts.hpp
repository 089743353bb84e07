// Motions of the hands for rollouts, from what they do now and what hands can do (docs/notebook/0026-where-hands-may-get-to.md):
//
//   dead_reckoned  as the tool's track goes on when nothing is heard
//   else           moved on with no acceleration, with the hand's own, or with that and kHandMs2 along an axis beside it
//
// (tool_prediction.hpp). In order of worth, and most bodies are touched from above: where there is time for few, the first are
// run; within kPredictableS those that go on as they do.
#pragma once

#include <array>

#include "server/reduce/tool_prediction.hpp"

namespace palpate {

struct HandRollout {
  bool dead_reckoned = false, accelerates = false;
  Vec3 beside_m_s2 = Vec3::Zero();
  int snapshots = 1;  ///< of the prediction horizon, evenly, the last at its end
  double weight = 1;  ///< of how far the body goes in it
};

inline constexpr std::size_t kRolloutsLeast = 2, kUndeviatedRollouts = 3;
inline constexpr int kRolloutSnapshots = 12;      ///< what swings within the prediction horizon is seen to
inline constexpr int kRoughRolloutSnapshots = 6;  ///< by rough steps, one each; of kRolloutSnapshots

inline const std::array<HandRollout, 6> kHandRollouts{{{.dead_reckoned = true, .snapshots = kRolloutSnapshots},
                                                       {.snapshots = kRolloutSnapshots},
                                                       {.accelerates = true, .snapshots = 2},
                                                       {.accelerates = true, .beside_m_s2 = {0, 0, kHandMs2}, .weight = 0.5},
                                                       {.accelerates = true, .beside_m_s2 = {kHandMs2, 0, 0}, .weight = 0.5},
                                                       {.accelerates = true, .beside_m_s2 = {0, kHandMs2, 0}, .weight = 0.5}}};

}  // namespace palpate
