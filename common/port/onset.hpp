// How a touch begins: the tool has come from outside through the surface, or the surface, wherever it came from, over the tool.
//
// Inside and outside alone do not tell: a thin body that is pressed far is locally inside out, and a tool that its upper side
// passes there would be taken for one that came from below. So a tool that does not touch remembers where it was: its nearest
// point of the surface, a material one, and the gap g from there, on the outward side. With p where that point is now, h where
// the tool is, relative to the surface the tool has gone
//
//     from p + g to h
//
// and touches where this way first goes through a triangle from its front, at the point next to there that is nearest to the
// tool. Where the body is inside out the tool is in front of two sheets that face each other, and has to do with the one alone
// from which it came. A tool whose way is not known, or is longer than kFollowedM, touches the nearest point of all where it is
// inside.
//
// Positions in m. What can go wrong: a way of more than kFollowedM through something thin is not noticed.
// The way is looked at as straight, the surface around the point as carried along without turning.
#pragma once

#include "common/port/surface.hpp"

namespace palpate {

/// Where a tool that does not touch was outside of the surface.
struct Clearance {
  bool known = false;
  SurfacePoint point;
  Vec3 gap = Vec3::Zero();  ///< from there to the tool [m]
};

/// Of a tool in one tick or stage; slower than a metre a second it goes less far in 10 ms, the longest step of a body.
inline constexpr double kFollowedM = 0.01;

struct Onset {
  bool touches = false;
  NearestPoint nearest;  ///< where it does, or else the nearest of all
};

/// Whether a tool that did not touch does so now; if not, `clearance` is brought up to date.
Onset look_for_contact(const SurfaceView& s, Positions x, const Vec3& tool, Clearance& clearance) noexcept;

/// The clearance of a tool that has just let go of `point`, `gap` from it; none where it is inside.
Clearance clearance_of(const SurfacePoint& point, const Vec3& gap, const Vec3& normal) noexcept;

}  // namespace palpate
