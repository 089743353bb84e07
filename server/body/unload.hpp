// The rest shape X of a body whose given shape is its equilibrium under gravity: x(X) = x*, with x* as given.
//
// The iteration is X <- X + (x* - x(X)), x(X) the equilibrium of the body with rest shape X (settle.hpp), until no node is
// further from x* than kUnloadedTo of the mean length of an element. A step without progress is halved. Rest lengths of springs
// are those between the nodes of X; masses stay those of x*. For a soft body no such X may exist: no stress-free shape then hangs
// like x*.
//
// Source: Sellier, An iterative method for the inverse elasto-static problem, J. Fluids Struct. 27 (2011).
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr double kUnloadedTo = 1e-4;

/// Returns the unloaded body; one that is not loaded is returned as it is. Throws InputError, with `where`, if no X is found.
LumpedBody unloaded(LumpedBody body, const std::string& where);

/// Returns a scene with its body at its rest shape; `where` names it in errors.
Scene opened(Scene scene, const std::string& where);
/// Reads a scene from a file and opens it.
Scene open_scene(const std::filesystem::path& file, const MeshFolders& besides = {});

}  // namespace palpate
