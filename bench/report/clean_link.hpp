// Replays the path of a real run in virtual time, over a link without jitter and loss.
#pragma once

#include <future>
#include <string>

#include "bench/fidelity/replay.hpp"
#include "bench/report/client_report.hpp"

namespace palpate {

struct CleanLink {
  std::string scheme;
  double rtt_ms = 0;
  Fidelity fidelity;
};

/// Replay with the scheme, states and frame rate of the report, from a server that needs no time from frame to patch. Runs on a
/// thread of its own, in parallel with the reference that it is compared with at the end.
class CleanLinkRun {
 public:
  /// Throws InputError if the report names no scheme of this build.
  CleanLinkRun(const Scene& scene, const ClientReport& report, double rtt_ms);
  /// Waits for the replay. Throws what replay() throws.
  CleanLink result(const ReferenceForce& reference);

 private:
  CleanLink clean_;
  std::future<std::vector<Vec3>> felt_;
};

}  // namespace palpate
