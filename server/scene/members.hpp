// Several bodies joined into one LumpedBody, whose members they are: their nodes, cells and triangles one after the other, each
// with its signed distance at rest on a grid of a quarter of its mean edge (at most kMostGridPoints points).
//
// They have in common what a LumpedBody has once: the kind of cells, the law and its shape, fibres, relaxation, mass-proportional
// damping and gravity.
#pragma once

#include "server/scene/settings.hpp"

namespace palpate {

/// Joins bodies with their surfaces, without ligaments, and tests them for overlap: nodes of the surface of each, which may lie
/// kTouchM deep in another. Throws InputError for two that overlap, which says how deep and where, and for bodies that do not
/// have in common what they must.
LumpedBody join_members(std::vector<LumpedBody> bodies, const std::vector<MemberSettings>& members, const SceneText& text);
/// Makes a body of this list; `members` has their names and frictions, and from here on also their nodes and distances.
LumpedBody joined(std::vector<LumpedBody> bodies, std::vector<Member> members);

}  // namespace palpate
