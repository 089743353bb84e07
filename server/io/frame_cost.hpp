// What a frame of a room costs on this machine, measured before anybody comes: a hand in virtual time presses into the body of
// the scene and swings there, and the processor time of the frames is taken, of those with a patch of `port` and of `hyper`
// in turn. How much a frame takes depends on where the hand is: thin parts bend far. The body's step is shared by all stations;
// each has a patch of its own, so that n of them take about step + n patch.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "server/body/finger_stiffness.hpp"

namespace palpate {

struct FrameCost {
  double step_ms = 0, port_ms = 0, hyper_ms = 0;  ///< means, as a server that is late adds them up; of the body, of one patch
  double ms(Scheme scheme, int stations) const { return step_ms + stations * (scheme == Scheme::hyper ? hyper_ms : port_ms); }
};

/// Frames of 1 / `rate_hz` seconds with a hand at `place`, for four tenths of a second at most; nothing for large bodies, and
/// where a step finds no solution. `stopwatch` in nanoseconds; none: the processor time of this thread.
std::optional<FrameCost> frame_cost(const Scene& scene, const FingerStiffness& place, double rate_hz,
                                    const std::function<std::int64_t()>& stopwatch = {});

}  // namespace palpate
