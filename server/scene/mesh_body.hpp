// Builds a body from a file with a mesh of tetrahedra.
#pragma once

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

/// Throws InputError if the file is no such mesh, lacks a region that is named, or leaves nothing that can move.
LumpedBody build_mesh_body(const MeshBodySettings& settings, const SceneText& text);

}  // namespace palpate
