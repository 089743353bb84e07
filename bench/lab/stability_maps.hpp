// The maps of `palpate-lab stability`: where a loop is stable and where not, over the round trip and each of the other axes.
#pragma once

#include <filesystem>
#include <vector>

#include "bench/lab/stability_cells.hpp"

namespace palpate {

/// Leaves map-AXIS-CONTACT.csv and .svg in `out` for rate, stiffness, loss, jitter and hand; those with fewer than two values are
/// left out.
void draw_stability_maps(const std::filesystem::path& out, const std::vector<StabilityCell>& cells);

}  // namespace palpate
