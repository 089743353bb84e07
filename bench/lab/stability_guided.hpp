// The part of palpate-lab stability with one hand that guides another.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

struct GuidedSweep {
  bool quick = false;
  std::uint64_t seed = 1;
  std::string out;
  unsigned jobs = 0;  ///< 0: one per core
};

/// Prints a row for each point and writes guided.csv, guided.svg and summary.json. Returns the program's exit code: 1 if a point
/// is not stable or gave more energy than the hold's beginning may.
int run_guided_sweep(const GuidedSweep& sweep);

}  // namespace palpate
