#include "bench/output/fidelity_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

Json fidelity_json(const Fidelity& f) {
  if (f.contact_ticks == 0) return {{"contact_ticks", 0}};
  return {{"snr_db", f.snr_db},
          {"rel_rms", f.rel_rms},
          {"p95_rel_error", f.p95_rel_error},
          {"lag_ms", f.lag_ms},
          {"force_step_max_n", f.force_step_max_n},
          {"contact_ticks", f.contact_ticks}};
}

std::string no_contact(const Scene& scene, std::span<const Vec3> path) {
  if (scene.tool.contact == ContactKind::attach)
    return "the tool never moved the body: it felt no force, and there is nothing to score";
  double least_m = std::numeric_limits<double>::max();
  for (const Vec3& tool : path)
    for (const Vec3& node : scene.body.nodes) least_m = std::min(least_m, (node - tool).squaredNorm());
  return fmt::format(
      "no contact: tool and body never met, so there is nothing to score; the tool came no nearer than {:.1f} mm to a node of "
      "\"{}\" at rest; `palpate-lab gesture` makes a motion that meets it",
      1e3 * std::sqrt(least_m), scene.name);
}

}  // namespace palpate
