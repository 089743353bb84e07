// Ligaments: springs from a body to fixed points.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Each gets a node of its own, fixed at `to_m`, and springs to it from the body's free nodes near `from_m`, as long as they are
/// in the given shape, which share its stiffness and damping alike. InputError where no node is near.
void add_ligaments(LumpedBody& body, const std::vector<LigamentSettings>& ligaments, const SceneText& text);

}  // namespace palpate
