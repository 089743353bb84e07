// The points of `palpate-lab stability` (stability_plan.hpp) on the cube of the paper, and what was measured in each.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/measure/stability_plan.hpp"

namespace palpate {

struct StabilityCell {
  StabilityPoint point;
  // measured
  LoopFault fault = LoopFault::none;
  double tail_mm = 0, growth_1_s = 0;  ///< motion left in the last 0.6 s, and its rate
  double shake_mm = 0, shake_mm_s = 0, generated_mj = 0;
  double cut_ms = 0;  ///< for which the force was cut (StabilityResult)
};

/// Static stiffness of the paper's cube as it is, grasped; to a tenth.
double cube_stiffness_n_m();

/// Of the paper's springs, or the same cube of finite elements.
enum class StabilityCube : std::uint8_t { springs, solid };

/// Fills in the measures, `jobs` at a time.
void measure_cells(std::vector<StabilityCell>& cells, StabilityCube cube, unsigned jobs);

/// The scene of a point, and its reference.
StabilityReference reference_of(const StabilityPoint& point, StabilityCube cube);

/// "port,grasp,free,release,...": what --only takes, and how a row of cells.csv begins.
std::string key_of(const StabilityPoint& point);
/// The other way; InputError, with `where` as the place.
StabilityPoint point_from(const std::string& key, const std::string& where);

std::string cells_csv(const std::vector<StabilityCell>& cells);
std::vector<StabilityCell> read_stability_cells(const std::filesystem::path& file);

}  // namespace palpate
