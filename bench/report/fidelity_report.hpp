// Compares the force felt in a real run with the full model: palpate-fidelity, and the subcommand `fidelity` of palpate-lab.
#pragma once

#include "bench/output/experiment.hpp"

namespace palpate {

inline constexpr const char* kFidelityText =
    "compare the force of a real run (palpate-client --report) with the 1 kHz full model on the same path";
inline constexpr const char* kFidelityExample = "--scene scenes/organ.json --report out/demo --out out/fidelity";

/// Adds the flags to `command`; parsing them sets `run`.
void add_fidelity_flags(CLI::App& command, Run& run);

}  // namespace palpate
