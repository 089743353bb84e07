// Compares the force felt in a real run with the full model: palpate-fidelity, and the sub-command `felt` of palpate-lab.
#pragma once

#include "bench/output/experiment.hpp"

namespace palpate {

inline constexpr const char* kFeltText =
    "what a real run displayed (palpate-client --report), beside the 1 kHz full model on the same path";
inline constexpr const char* kFeltExample = "--scene scenes/organ.json --report out/demo --out out/felt";

/// Adds the flags to `command`; parsing them sets `run`.
void add_felt_flags(CLI::App& command, Run& run);

}  // namespace palpate
