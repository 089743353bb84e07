// Fixes nodes of a body.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Fixes the nodes that `fixed` names; a face of the body's bounding box fixes the nodes within half a spacing of it.
void fix_nodes(LumpedBody& body, const FixedSettings& fixed, const Vec3& spacing);
/// Throws InputError if no node can move.
void refuse_all_fixed(const LumpedBody& body, const SceneText& text, const std::string& path);

}  // namespace palpate
