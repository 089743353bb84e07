// Describes an untouched scene in lines for a person.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/io/frame_cost.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct Description {
  std::vector<std::string> lines;
  std::optional<FrameCost> least_cost;  ///< of a frame, at the place of several where it takes the shortest; empty: not measured
};

/// Returns lines with the number of fixed nodes, the body's weight, its stiffness under a finger and the cost of frames of 1 /
/// `rate_hz` seconds on this machine; with a warning if (nearly) nothing is fixed. Runs for up to about a second; for large
/// bodies the slow parts are omitted.
Description describe(const Scene& scene, double rate_hz);

}  // namespace palpate
