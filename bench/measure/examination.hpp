// The four gestures of a hand that examines a body, joined to one motion, as `palpate-lab accuracy` plays it.
//
//     press    10 mm in within 0.3 s, held, and up again
//     stroke   6 mm in, then 15 mm sideways and back along it within 1 s, up again
//     tap      three times 6 mm in and out at 3 Hz
//     release  10 mm in within 0.3 s, and then the grip opens: the tool swings back at 5 Hz, 20 % damped
// A touching tool begins kGapM above the surface and goes equally deep.
//
// Fast strokes, in which the tool leaves the place of a patch within a round trip, are a motion of their own:
//
//     fast strokes   6 mm in within 0.5 s, 22 mm aside within 0.35 s, three times 44 mm across and back within 0.63 s each,
//                    131 mm/s at most, to the middle within 0.35 s, and up again; each way of minimum jerk
//
// An examination takes place at the top of the body, on the surface below home_of() (start_of()), or at a drawn place. Places are
// drawn evenly over the area of the surface where no node within the tip's radius is fixed and a hand can reach the surface along
// its normal, through kFreeWayM of free space. There it moves along the inward normal and strokes along the tangent nearest to x.
// Where the body is thinner than the depth divided by kDeepestShare, at the top as elsewhere, all lengths shrink in proportion,
// so that a thin lobe is not pressed through.
#pragma once

#include <cstdint>
#include <vector>

#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Start and directions of an examination.
struct ExaminedPlace {
  Vec3 start = Vec3::Zero();   ///< tool position at the beginning [m]
  Vec3 into = -Vec3::UnitZ();  ///< unit vector of the press
  Vec3 aside = Vec3::UnitX();  ///< unit vector of the stroke
  double scale = 1;            ///< factor on all lengths but the gap
};

inline constexpr double kFreeWayM = 0.025;     ///< free space along the normal, without another part of the surface
inline constexpr double kDeepestShare = 0.25;  ///< largest depth of a press, as a share of the body's thickness there

/// Place at the top of the body, where a tool starts: start_of().
ExaminedPlace top_of(const Scene& scene);
/// `count` randomly drawn places on a touched scene, the same for the same scene. Throws InputError if the surface has no such
/// place.
std::vector<ExaminedPlace> drawn_places(const Scene& scene, int count);

Motion examination(const Scene& scene, const ExaminedPlace& place);
Motion fast_strokes(const Scene& scene, const ExaminedPlace& place);
inline Motion examination(const Scene& scene) { return examination(scene, top_of(scene)); }

}  // namespace palpate
