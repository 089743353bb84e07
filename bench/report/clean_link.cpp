#include "bench/report/clean_link.hpp"

#include "bench/output/output.hpp"
#include "common/base/error.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

Scheme scheme_of(const ClientReport& report) {
  if (const auto scheme = scheme_from_name(report.scheme)) return *scheme;
  throw InputError("--clean-rtt-ms", "the report names " + (report.scheme.empty() ? "no scheme" : "\"" + report.scheme + "\""),
                   "a scheme of this build in run.scheme of its summary.json");
}

Motion motion_of(const std::vector<Vec3>& positions) {
  std::vector<MotionPoint> points;
  for (std::size_t i = 0; i < positions.size(); ++i) points.push_back({static_cast<double>(i) * 1e-3, positions[i]});
  return Motion(std::move(points));
}

std::vector<Vec3> felt_over(const Scene& scene, const std::vector<Vec3>& positions, ReplayOptions options) {
  // The caller compares the forces, as it is still computing the reference.
  const std::vector<Vec3> zero(positions.size(), Vec3::Zero());
  const ReferenceForce none{zero, std::vector<std::uint8_t>(positions.size()), zero};
  options.references = {&none, 1};
  std::vector<Vec3> felt;
  for (const ReplayTick& tick : replay(scene, motion_of(positions), options, stopwatch_ns).ticks) felt.push_back(tick.felt);
  return felt;
}

}  // namespace

CleanLinkRun::CleanLinkRun(const Scene& scene, const ClientReport& report, double rtt_ms) {
  ReplayOptions options;
  options.scheme = scheme_of(report);
  options.order = report.order;
  options.held = {tool_number(scene, report.tool, "the report")};
  options.link.latency = from_seconds(rtt_ms * 0.5e-3);
  if (report.rate_hz > 0) options.rate_hz = report.rate_hz;
  clean_ = {report.scheme, rtt_ms, {}};
  felt_ = std::async(std::launch::async, felt_over, scene, report.positions, options);
}

CleanLink CleanLinkRun::result(const ReferenceForce& reference) {
  clean_.fidelity = compare(felt_.get(), reference.force, kSkipTicks);
  return clean_;
}

}  // namespace palpate
