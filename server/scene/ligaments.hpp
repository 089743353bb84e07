// Ligaments: springs from a body to fixed points.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Adds for each ligament a fixed node at `to_m`, with springs to the body's free nodes near `from_m`, which share its stiffness
/// and damping equally. Their rest lengths are those of the given shape. Only nodes from `first` to `end` count. Throws
/// InputError if no node is near.
void add_ligaments(LumpedBody& body, std::uint32_t first, std::uint32_t end, const std::vector<LigamentSettings>& ligaments,
                   const SceneText& text);

}  // namespace palpate
