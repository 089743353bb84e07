// Motions of the hands for rollouts: the body is stepped on from its state x* over the mean prediction horizon tau of a frame,
// once for each of them, and x(t) - x* at HandRollout::snapshots moments are snapshots of the basis (snapshot_set.hpp). Of a tool
// at h* with velocity v, t after the stamp (tool_prediction.hpp),
//
//     dead_reckoned   h(t) = h* + v (t - t^2 / (2 T)), slower and slower: as its track continues without samples
//     else            h(t) = h* + v t + a (t e - e^2 / 2),   e = min(t, kAccelerationTimeS);   at rest after kPredictionMostS
//
//     a = 0,  or a_h (accelerates),  or a_h + beside_m_s2;     a_h = (h* - 2 h(-T_d) + h(-2 T_d)) / T_d^2,   T_d = 30 ms,
//                                                              not more than kHandAccelerationMostMs2
//
// all hands at once in each. h [m], v [m/s], a [m/s^2]; of a grasp h is where its node is taken (grasp.hpp).
//
// In order of worth, and most bodies are touched from above: where there is time for few, the first are run; where tau is below
// kPredictableS the kUndeviatedRollouts first. A rollout whose steps do not converge ends there; where that is the dead-reckoned
// one, none count. Measured: docs/notebook.md, 26. How many fit into a frame: affordable_rollouts(), state_prediction.cpp.
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

inline constexpr std::size_t kRolloutsLeast = 2;       ///< whatever they take: one alone lost up to 13 dB (docs/notebook.md, 24)
inline constexpr std::size_t kUndeviatedRollouts = 3;  ///< the first, in which no hand turns aside
inline constexpr int kRolloutSnapshots = 12;           ///< 3 miss what swings within the horizon (docs/notebook.md, 25)
inline constexpr int kRoughRolloutSnapshots = 6;       ///< by rough steps, one each; 12 take twice as long (docs/notebook.md, 33)

/// Tuned: docs/notebook.md, 26.
inline const std::array<HandRollout, 6> kHandRollouts{
    {{.dead_reckoned = true, .snapshots = kRolloutSnapshots},
     {.snapshots = kRolloutSnapshots},
     {.accelerates = true, .snapshots = 2},
     {.accelerates = true, .beside_m_s2 = {0, 0, kHandAccelerationMs2}, .weight = 0.5},
     {.accelerates = true, .beside_m_s2 = {kHandAccelerationMs2, 0, 0}, .weight = 0.5},
     {.accelerates = true, .beside_m_s2 = {0, kHandAccelerationMs2, 0}, .weight = 0.5}}};

}  // namespace palpate
