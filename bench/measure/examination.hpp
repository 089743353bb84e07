// The four gestures of a hand that examines a body, one after the other as one motion: what `palpate-lab truth` plays.
//
//     press    10 mm in within 0.3 s, held, and up again
//     stroke   6 mm in, then 15 mm sideways and back along it within 1 s, up again
//     tap      three times 6 mm in and out at 3 Hz
//     release  10 mm in within 0.3 s, and then the grip opens: the tool swings back at 5 Hz, 20 % damped
// A tool that only touches begins kGapM above the surface, and goes as deep.
//
// An examination is at the top of the body, where home_of() is above it, or at a place that was drawn: evenly over the area of
// the surface, where no node within the tip's radius is held and a hand reaches the surface along its normal, kFreeWayM of it.
// There it goes along the inward normal and strokes along the tangent that is nearest to x. Where the body is thinner than
// kDeepestShare of the depth allows, all lengths are smaller in proportion, so that a thin lobe is not pressed through.
#pragma once

#include <cstdint>
#include <vector>

#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Where an examination begins and which way it goes.
struct ExaminedPlace {
  Vec3 start = Vec3::Zero();   ///< tool position at the beginning [m]
  Vec3 into = -Vec3::UnitZ();  ///< direction of the press, of length 1
  Vec3 aside = Vec3::UnitX();  ///< direction of the stroke, of length 1
  double scale = 1;            ///< of all lengths but the gap
};

inline constexpr double kFreeWayM = 0.025;     ///< along the normal, without another part of the surface
inline constexpr double kDeepestShare = 0.25;  ///< depth of a press, of the thickness of the body there

/// At the top of the body, where a tool starts: home_of().
ExaminedPlace top_of(const Scene& scene);
/// `count` places of a scene that is touched, drawn by chance: the same for the same scene. InputError where the surface has no
/// such place.
std::vector<ExaminedPlace> drawn_places(const Scene& scene, int count);

Motion examination(const Scene& scene, const ExaminedPlace& place);
inline Motion examination(const Scene& scene) { return examination(scene, top_of(scene)); }

}  // namespace palpate
