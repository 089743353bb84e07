// Record of what was run, the object "run" of every result file of palpate-lab and palpate-fidelity.
//
//     program, version, experiment
//     scheme, order, seed      as given or by default, if the experiment has such a flag
//     scene, motion, recording, report
//                              {file, hash, name}: the hash is that of the file's bytes (provenance.hpp), the name the scene's
//                              own; if no scene or motion is named, the experiment's own is used
//     link                     {rate_hz, rtt_ms, jitter_ms, loss_pct, burst, compute_ms}, as far as the experiment has them
//     flags                    the other flags, except --out
//     machine                  {processor, cores, system}
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/output/output.hpp"

namespace palpate {

/// Sets the record from the parsed command line of an experiment; call once, before it runs.
void set_run_record(const std::string& program, const std::string& experiment, const CLI::App& typed);
/// Returns the record; an object without entries before it is set.
const Json& run_record();

}  // namespace palpate
