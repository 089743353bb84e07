// Describes an untouched scene in lines for a person.
#pragma once

#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// Returns lines with the number of fixed nodes, the body's weight, its stiffness under a finger and the cost of frames of 1 /
/// `rate_hz` seconds on this machine; with a warning if (nearly) nothing is fixed. Runs for up to about a second; for large
/// bodies the slow parts are omitted.
std::vector<std::string> describe(const Scene& scene, double rate_hz);

}  // namespace palpate
