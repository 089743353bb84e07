// What a scene is like before anybody touches it, in lines for a person.
#pragma once

#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// How many nodes are held and what the body weighs, how stiff it is under a finger, what a frame of 1 / `rate_hz` seconds costs
/// on this machine; with a warning where (nearly) nothing is held. Takes up to a second or so; of large bodies the rest is left
/// out.
std::vector<std::string> describe(const Scene& scene, double rate_hz);

}  // namespace palpate
