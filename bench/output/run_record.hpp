// What was run, as the object "run" of every result file of palpate-lab and palpate-felt: without it a file does not say what its
// figures are of.
//
//     program, version, experiment
//     scheme, order, seed      as given or by default, where the experiment has such a flag
//     scene, motion, recording, report
//                              {file, hash, name}: the hash is that of the file's bytes (provenance.hpp), the name the scene's
//                              own; where a scene or motion is not named, the experiment's own is used
//     link                     {rate_hz, rtt_ms, jitter_ms, loss_pct, burst, compute_ms}, as far as the experiment has them
//     flags                    the other flags, but --out
//     machine                  {processor, cores, system}
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "bench/output/output.hpp"

namespace palpate {

/// From the parsed line of an experiment: once, before it runs.
void set_run_record(const std::string& program, const std::string& experiment, const CLI::App& typed);
/// What was set; an object without entries before that.
const Json& run_record();

}  // namespace palpate
