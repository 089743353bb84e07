// Maps of `palpate-lab stability`: stable and unstable loops over the round trip and each of the other axes.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/lab/stability_cells.hpp"

namespace palpate {

/// Writes map-AXIS-CONTACT.csv and .svg to `out` for rate, stiffness, loss, jitter and hand; maps with fewer than two values are
/// omitted.
void draw_stability_maps(const std::filesystem::path& out, const std::vector<StabilityCell>& cells);

}  // namespace palpate
