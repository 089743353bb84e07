// A comparison with the full model as numbers of a result file; and what is said where there is none.
#pragma once

#include <span>
#include <string>

#include "bench/fidelity/metrics.hpp"
#include "bench/output/output.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

/// By the names of metrics.hpp. Without contact `contact_ticks` is 0 and stands alone: there is nothing to score.
Json fidelity_json(const Fidelity& fidelity);

/// One line for a tool that took this path and was never pushed by the body, with how far from it it stayed.
std::string no_contact(const Scene& scene, std::span<const Vec3> path);

}  // namespace palpate
