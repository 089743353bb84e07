// Cost of a room's frames on this machine, measured before any station joins. A simulated hand in virtual time presses into the
// body and oscillates there, and the processor time of the frames is measured, in turn with a patch of `port` and of `hyper`. The
// cost depends on the place of the hand, as thin parts bend far. All stations share the body's step and each has its own patch,
// so n of them cost about step + n patch. On the wall a frame takes this divided by the share of a core that the trial got.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>

#include "server/body/surface_stiffness.hpp"
#include "server/core/frame_costs.hpp"

namespace palpate {

struct FrameCost {
  double step_ms = 0, port_ms = 0, hyper_ms = 0;  ///< mean processor time of the body's step and of one patch per scheme [ms]
  double step_most_ms = 0;                        ///< largest of the steps
  double rollouts_ms = 0;                         ///< part of hyper_ms that the nonlinear patches of a frame share
  double core_share = 1;                          ///< processor time per time on the wall
  double ms(Scheme scheme, int stations) const { return step_ms + stations * (scheme == Scheme::hyper ? hyper_ms : port_ms); }
};

/// Costs that a room expects on the wall of a machine that gives it `core_share` of a core.
inline FrameCosts::Expected expected_costs(const FrameCost& cost, double core_share) {
  const auto on_wall = [&](double processor_ms) { return from_seconds(1e-3 * processor_ms / core_share); };
  return {on_wall(cost.step_ms), on_wall(cost.port_ms), on_wall(std::max(0.0, cost.hyper_ms - cost.rollouts_ms)),
          on_wall(cost.rollouts_ms)};
}

inline constexpr std::size_t kTimedNodesMost = 5'000;  ///< of a body whose room can be built within about a second

/// Measures frames of 1 / `rate_hz` seconds with a hand at `place`, for 0.4 s and the frame in progress. Empty for larger bodies
/// and if a step finds no solution. `stopwatch` counts nanoseconds; none: the processor time of this thread. `depth_m`: depth of
/// the press; none: a tenth of the body's shortest side that is not flat, at most 6 mm.
std::optional<FrameCost> frame_cost(const Scene& scene, const SurfaceStiffness& place, double rate_hz,
                                    const std::function<std::int64_t()>& stopwatch = {}, std::optional<double> depth_m = {});

}  // namespace palpate
