// What palpate-bench measures, a file each. Registered by main() once the scene folder is known.
#pragma once

namespace palpate {

void add_tick_benchmarks();        ///< the haptic tick, patch player alone and whole
void add_patch_benchmarks();       ///< a patch on its way: encode, decode, check, compile, catch up
void add_body_benchmarks();        ///< forces, tangents and solvers over body size
void add_frame_benchmarks();       ///< a server's frame: scenes and schemes
void add_integrator_benchmarks();  ///< error of the felt force against the server's run time, over its step
void add_trust_benchmarks();       ///< the trust channel: seal, open, refuse, answer, shake hands
void add_record_benchmarks();      ///< a recording, per second of the session: written at server and client, read

}  // namespace palpate
