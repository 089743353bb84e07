// From a mesh of tetrahedra in a file to a body.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Throws InputError when the file is no such mesh, when a region is named that it does not have, or when nothing can move.
LumpedBody build_mesh_body(const MeshBodySettings& settings, const SceneText& text);

}  // namespace palpate
