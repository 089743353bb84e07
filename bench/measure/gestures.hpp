// Intentions of a hand in the closed loop, as motions that end at rest.
//
//     press    into the body along a minimum-jerk path, and stay there
//     tap      three times in and out at 3 Hz, and then rest lightly on the body
//     stroke   in, then 20 mm sideways and back along it, and stay there
//     release  as press; then the grip changes while the hand stands still (figure 18 of the paper)
// of a tool with a body, which is held upright, also
//     rock     in, then once to and fro by 12 degrees about the x axis, and stay there
//     twist    in, then turned by 25 degrees about the direction into the body, and stay there
// and of a needle alone
//     insert   2.5 times as deep within 0.6 s, and stay there
//     withdraw the same, and after 0.4 s up again by half of it
// A touching tool begins kGapM above the surface.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/minimum_jerk.hpp"
#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

enum class Gesture : std::uint8_t { press, tap, stroke, release, rock, twist, insert, withdraw };
inline constexpr std::array<std::string_view, 8> kGestureNames{"press", "tap",   "stroke", "release",
                                                               "rock",  "twist", "insert", "withdraw"};
inline std::string_view name_of(Gesture g) { return kGestureNames[static_cast<std::size_t>(g)]; }
std::optional<Gesture> gesture_from_name(std::string_view name);

inline constexpr double kGapM = 0.001;

struct GesturePlan {
  Motion intention;
  double still_s = 0;    ///< time from which the intention stands still
  double release_s = 0;  ///< time at which a hand opens: in the middle of a tap or a stroke, at the end of the others
};

/// `depth_m` is the intended depth of a press (a stroke, a rock and a twist have 6/10 of it, a tap 6/10 and in the end 2/10).
GesturePlan plan_gesture(const Scene& scene, Gesture gesture, double depth_m);

/// Direction in which the tool presses: down; in a sheet up, along y.
Vec3 into_body(const Scene& scene);
/// Position of a tool at the beginning: kGapM above the surface of the hanging body below home_of(), or above its nearest upper
/// face; or the node that it grasps.
Vec3 start_of(const Scene& scene);

}  // namespace palpate
