// How hands may move on while a patch lasts, from what they do now and what hands can do (docs/decisions/0026):
//
//   coasts        as the tool's track goes on when nothing is heard (coasting.hpp)
//   else          x + v t + a (t e - e^2 / 2), e = min(t, kSpeedsUpS), with a = 0, with the hand's own acceleration, or with that
//                 and kHandMs2 along an axis beside it; after kGoesOnS at rest, as no hand is known for longer
//
// in order of worth, and most bodies are touched from above: where there is time for few, the first are looked at. Within
// kAlmostSureS no hand gets far beside where it would get by itself.
#pragma once

#include <algorithm>
#include <array>

#include "server/reduce/expected_ways.hpp"

namespace palpate {

struct HandFuture {
  bool coasts = false, speeds_up = false;
  Vec3 beside_m_s2 = Vec3::Zero();
  int looks = 1;      ///< of the bridged time, evenly, the last at its end
  double weight = 1;  ///< of how far the body goes in it
};

inline constexpr double kSpeedsUpS = 0.05, kGoesOnS = 0.25;
inline constexpr double kHandMostMs2 = 10;  ///< no hand speeds up more
inline constexpr double kAlmostSureS = 0.15;
inline constexpr std::size_t kFuturesLeast = 2, kFuturesOfItself = 3;
inline constexpr int kLooksMost = 12;  ///< what swings within the bridged time is seen to
inline constexpr int kRoughLooks = 6;  ///< by rough steps, one each; of kLooksMost

inline const std::array<HandFuture, 6> kHandFutures{{{.coasts = true, .looks = kLooksMost},
                                                     {.looks = kLooksMost},
                                                     {.speeds_up = true, .looks = 2},
                                                     {.speeds_up = true, .beside_m_s2 = {0, 0, kHandMs2}, .weight = 0.5},
                                                     {.speeds_up = true, .beside_m_s2 = {kHandMs2, 0, 0}, .weight = 0.5},
                                                     {.speeds_up = true, .beside_m_s2 = {0, kHandMs2, 0}, .weight = 0.5}}};

/// Where a hand is `after_s` from now.
inline ToolAt moved_on(const ToolAt& now, const Vec3& acceleration_m_s2, double after_s) {
  const double t = std::min(after_s, kGoesOnS);
  const Vec3 velocity = now.velocity + std::min(t, kSpeedsUpS) * acceleration_m_s2;
  return {now.position + t * now.velocity + way_of_speeding_up(acceleration_m_s2, t, kSpeedsUpS),
          after_s > kGoesOnS ? Vec3(Vec3::Zero()) : velocity};
}

}  // namespace palpate
