// Points of `palpate-lab stability` (stability_plan.hpp) on the cube of the paper, with their results.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/measure/stability_plan.hpp"

namespace palpate {

struct StabilityCell {
  StabilityPoint point;
  // Results:
  LoopFault fault = LoopFault::none;
  double tail_mm = 0, growth_1_s = 0;  ///< motion left in the last 0.6 s, and its growth rate
  double shake_mm = 0, shake_mm_s = 0, generated_mj = 0;
  double cut_ms = 0;  ///< time for which the force was cut (StabilityResult)
};

/// Static stiffness of the paper's unscaled cube, grasped, to a tenth.
double cube_stiffness_n_m();

/// Material of the cube: the paper's springs, or finite elements.
enum class StabilityCube : std::uint8_t { springs, solid };

/// Fills in the results, `jobs` at a time.
void measure_cells(std::vector<StabilityCell>& cells, StabilityCube cube, unsigned jobs);

/// Scene of a point, with its reference.
StabilityReference reference_of(const StabilityPoint& point, StabilityCube cube);

/// Key of a point, as --only accepts it and as a row of cells.csv begins: "port,grasp,free,release,...".
std::string key_of(const StabilityPoint& point);
/// Parses a key; throws InputError that names `where`.
StabilityPoint point_from(const std::string& key, const std::string& where);

std::string cells_csv(const std::vector<StabilityCell>& cells);
std::vector<StabilityCell> read_stability_cells(const std::filesystem::path& file);

}  // namespace palpate
