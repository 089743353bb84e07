// The onset of a touch: the tool has come from outside through the surface, or the surface, wherever it came from, over the tool.
//
// Inside and outside alone do not decide this: a thin body that is pressed far is locally inside out, and a tool that its upper
// side passes there would appear to come from below. So a tool that is not touching stores its last clear position: its nearest
// point of the surface, a material one, and the gap g from there, on the outward side. With p the present position of that point
// and h that of the tool, the tool has moved relative to the surface
//
//     from p + g to h
//
// and touches where this path first enters a triangle from its front, at the point near that entry that is nearest to the tool.
// Where the body is inside out the tool is in front of two sheets that face each other, and only the one from which it came
// counts. A tool whose path is unknown, or longer than kFollowedM, touches the nearest point of all where it is inside.
//
// A sphere of a tool with a body (tool_shape.hpp) touches where its centre is nearer than its radius, or inside: at the point
// near the nearest of all whose normal passes through the centre, where the force of the contact law begins at zero.
//
// Positions in m. What can go wrong: a path of more than kFollowedM through something thin is not noticed. The path is assumed
// straight, and the surface around the point is assumed to move without rotation.
#pragma once

#include "common/patch/surface.hpp"

namespace palpate {

/// Last clear position of a tool that is not touching.
struct Clearance {
  bool known = false;
  SurfacePoint point;
  Vec3 gap = Vec3::Zero();  ///< vector from there to the tool [m]
};

/// Longest path of a tool in one tick or stage that is followed [m]; below one metre a second it moves less in 10 ms, the longest
/// step of a body.
inline constexpr double kFollowedM = 0.01;

struct Onset {
  bool touches = false;
  NearestPoint nearest;  ///< contact point if it touches, otherwise the nearest of all
};

/// Decides whether a tool that was not touching touches now; if not, updates `clearance`. `radius_m`: of the sphere around
/// `tool`, 0 = a point.
Onset look_for_contact(const SurfaceView& s, Positions x, const Vec3& tool, double radius_m, Clearance& clearance) noexcept;

/// Returns the clearance of a tool that has just left `point` and is `gap` away from it; unknown where it is inside.
Clearance clearance_of(const SurfacePoint& point, const Vec3& gap, const Vec3& normal) noexcept;

}  // namespace palpate
