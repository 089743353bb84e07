// Motions of a hand on any body, derived from its own surface while it hangs still.
//
// A touching tool comes down on the surface from 20 mm above, below home_of(), or, if there is nothing below that (a ring, a
// hollow), at the nearest place of the upper side; a grasping tool begins at its node. h is the height of the body there, d =
// min(10 mm, h / 8) the depth, r = min(15 mm, a tenth of the body's length) the sideways range of a hand:
//
//     press    d deep within 0.4 s, held for 0.6 s, and off again
//     stroke   0.6 d deep, r to either side along x within 2 s, at that depth below the surface as it rests
//     tap      three times 0.6 d deep at 3 Hz
//     circle   0.6 d deep, once around a circle of radius r within 3 s
//     tour     all of them in turn
//     insert   min(30 mm, h / 2) deep within 1.5 s, held for 0.6 s, and out again as fast: of a needle
// All along minimum-jerk paths, down the z axis (in a sheet: -y), the first and last 0.3 s at rest.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

enum class SurfaceGesture : std::uint8_t { press, stroke, tap, circle, tour, insert };
inline constexpr std::array<std::string_view, 6> kSurfaceGestureNames{"press", "stroke", "tap", "circle", "tour", "insert"};
inline std::string_view name_of(SurfaceGesture g) { return kSurfaceGestureNames[static_cast<std::size_t>(g)]; }
std::optional<SurfaceGesture> surface_gesture_from_name(std::string_view name);

/// Returns a motion with one position per millisecond.
Motion surface_gesture(const Scene& scene, SurfaceGesture gesture);

}  // namespace palpate
