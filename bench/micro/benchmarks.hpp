// Benchmarks of palpate-bench, one file each. Registered by main() once the scene folder is known.
#pragma once

namespace palpate {

void add_tick_benchmarks();   ///< haptic tick: patch player alone, and whole
void add_patch_benchmarks();  ///< path of a patch: encode, decode, check, compile, catch up
void add_body_benchmarks();   ///< forces, tangents and solvers over body size
void add_frame_benchmarks();  ///< frame of a server: scenes and schemes
void add_cut_benchmarks();    ///< changes of topology: a blade that goes into a body
void add_trust_benchmarks();  ///< trust channel: seal, open, refuse, answer, handshake

}  // namespace palpate
