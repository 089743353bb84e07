// The rest shape X of a body that is given as gravity holds it: that which hangs as x* was given, x(X) = x*.
//
// Found by X <- X + (x* - x(X)), x(X) the equilibrium of the body with rest shape X (settle.hpp), until no node is further from
// x* than kUnloadedTo of the mean length of an element. Where a step makes no progress it is halved. Rest lengths of springs are
// those between the nodes of X; masses stay those of x*. A soft body has no such X: nothing that hangs like that was ever free of
// stress.
//
// Source: Sellier, An iterative method for the inverse elasto-static problem, J. Fluids Struct. 27 (2011).
#pragma once

#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr double kUnloadedTo = 1e-4;

/// A body that is not loaded is returned as it is. Throws InputError, with `where`, when no X is found.
LumpedBody unloaded(LumpedBody body, const std::string& where);

/// A scene that was read, its body at its rest shape; `where` names it in errors.
Scene opened(Scene scene, const std::string& where);
/// The same of a file.
Scene open_scene(const std::filesystem::path& file, const MeshFolders& besides = {});

}  // namespace palpate
