// Clips: springs that hold tissue together.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Adds for each clip springs between the nodes of cells that lie within `radius_m` of `at_m` and have a cell in common, which
/// share its stiffness and damping equally. They rest as the given shape is, and join nodes of the uncut body: where a cut parts
/// these, now or later, the springs hold its walls together. Throws InputError if no two such nodes are near.
void add_clips(LumpedBody& body, const std::vector<TissueClipSettings>& clips, const SceneText& text);

}  // namespace palpate
