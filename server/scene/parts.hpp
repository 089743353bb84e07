// Rigid parts beside a body: closed surfaces, each with its signed distance on a grid of at most about kMostGridPoints points.
//
// A part and the body that overlap at the start are refused. Both are tested: nodes of the body's surface, which may lie kTouchM
// deep in the part, and vertices of the part in the body.
#pragma once

#include "server/scene/settings.hpp"

namespace palpate {

inline constexpr std::size_t kMostParts = 16, kMostPartTriangles = 20'000;
inline constexpr double kMostGridPoints = 1e5;  ///< a bone of 0.1 x 0.1 x 0.3 m has a spacing of 3 mm
inline constexpr double kTouchM = 1e-5;         ///< what rounding in files makes of surfaces that touch

/// Returns a part with this surface, without what the scene says of it.
RigidPart make_part(std::vector<Vec3> vertices, std::vector<Triangle> triangles, const Mat3& rotation);
/// Reads the parts' surfaces and adds them to the body. Throws InputError for one that is not closed, is too large, or overlaps
/// the body; that names the part, the depth and the place.
void add_parts(LumpedBody& body, const std::vector<PartSettings>& parts, const SceneText& text);

}  // namespace palpate
