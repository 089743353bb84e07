// The state in which a body hangs still: F(x, 0) = 0 with its fixed nodes, found by long L-stable steps whose velocity is thrown
// away.
#pragma once

#include "server/body/integrator.hpp"

namespace palpate {

/// At time 0. The rest shape itself when nothing pulls (no gravity); otherwise throws std::runtime_error when no equilibrium is
/// found.
BodyState settled_state(const Dynamics& dynamics, const Skin& skin);

}  // namespace palpate
