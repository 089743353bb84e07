// Cells of `palpate-lab stability`: points of the plan (stability_plan.hpp) on the cube of the paper, with their results.
#pragma once

#include <string>

#include "bench/lab/cells.hpp"
#include "bench/measure/stability_plan.hpp"

namespace palpate {

struct StabilityCell {
  StabilityPoint point;
  // Results:
  LoopFault fault = LoopFault::none;
  double tail_mm = 0, growth_1_s = 0;  ///< motion left in the last 0.6 s, and its growth rate
  double shake_mm = 0, shake_mm_s = 0, generated_mj = 0;
  double cut_ms = 0;      ///< time for which the force was cut (StabilityResult)
  double step_max_n = 0;  ///< largest force step at a hand-over
};

/// Points of a sweep: one hand with a point; several hands; one hand with a tool that has a body, or a needle.
enum class StabilityKind : std::uint8_t { hand, hands, tools };
StabilityKind kind_of(const StabilityPoint& point);

/// Table of a kind of points: for several hands with columns for their number, distance and round trips, for tools with one for
/// the tool.
CellTable<StabilityCell> stability_table(StabilityKind kind);
/// Point of a key, as --only accepts it; throws InputError if there is no such loop.
StabilityPoint stability_point(const std::string& key, StabilityKind kind);

/// Static stiffness of the paper's unscaled cube, grasped, to a tenth.
double cube_stiffness_n_m();

/// Material of the cube: the paper's springs, or finite elements. For several hands it is a block as wide as they need; for a
/// needle it is finite elements with the toughness of liver.
enum class StabilityCube : std::uint8_t { springs, solid };

/// Scene of a point, with its reference.
StabilityReference reference_of(const StabilityPoint& point, StabilityCube cube);

/// Sweep over the points; the references are computed once for all points that differ in scheme and link alone.
CellSweep<StabilityCell> stability_sweep(const std::vector<StabilityPoint>& points, StabilityCube cube, StabilityKind kind);

}  // namespace palpate
