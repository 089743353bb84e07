// `palpate-lab stability --body`: the full model under every treatment (body_trial.hpp), spread over stiffness ratios to 10^4,
// damping from none to far beyond critical, node masses of 1e-6 to 10 kg, sub-steps of 0.1 to 50 ms, compressions to 90 %,
// inversions and fast pulls.
#pragma once

#include <cstdint>
#include <string>

#include "bench/lab/cells.hpp"

namespace palpate {

struct BodySweep {
  bool quick = false;
  std::uint64_t seed = 1;
  std::string only, out;
  CellFlags cells;
};
/// Writes cells.csv, summary.json and body-*.svg to `out`; `only`: a single trial, given as a row of cells.csv begins.
int run_body_sweep(const BodySweep& sweep);

}  // namespace palpate
