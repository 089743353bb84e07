// Fidelity figures for a result file, and the message if there are none.
#pragma once

#include <span>
#include <string>

#include "bench/fidelity/metrics.hpp"
#include "bench/output/output.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// Uses the names of metrics.hpp. Without contact only `contact_ticks`, which is 0, is present, as there is nothing to score.
Json fidelity_json(const Fidelity& fidelity);

/// One line for a tool whose path never met the body, with its least distance from it.
std::string no_contact(const Scene& scene, std::span<const Vec3> path);

}  // namespace palpate
