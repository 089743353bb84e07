// Which nodes of a body never move.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// A face of the body's bounding box fixes the nodes within half a spacing of it.
void fix_nodes(LumpedBody& body, const FixedSettings& fixed, const Vec3& spacing);
/// Throws when no node is left that can move.
void refuse_all_fixed(const LumpedBody& body, const SceneText& text, const std::string& path);

}  // namespace palpate
