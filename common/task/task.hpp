// A training task on a body: what a trainee is asked to do. score.hpp judges a hand by it. Frame W, SI units.
//
//   find   press a button of the device while the tool touches the body above a hidden lump
//   press  hold the size of the force within a band, without a break, for a time
//   trace  follow a line on the surface of the body at rest, from its first point to its last, while touching
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

/// The lump is a ball (server/scene/lump.hpp). A mark within `within_m` of the segment from `above` to `lump` scores in full.
struct FindTask {
  Vec3 lump = Vec3::Zero();   ///< its centre
  Vec3 above = Vec3::Zero();  ///< point of the surface at rest that is nearest to it, among those that can move
  double radius_m = 0, within_m = 0;

  bool operator==(const FindTask&) const = default;
};

struct PressTask {
  double min_n = 0, max_n = 0, time_s = 0;

  bool operator==(const PressTask&) const = default;
};

struct LinePoint {
  Vec3 at = Vec3::Zero(), normal = Vec3::UnitZ();  ///< on the surface at rest; unit outward normal there

  bool operator==(const LinePoint&) const = default;
};
struct TraceTask {
  std::vector<LinePoint> line;  ///< 2 to kMaxLinePoints
  double tolerance_m = 0;       ///< largest distance from the line, along the surface, at which the tool follows it

  bool operator==(const TraceTask&) const = default;
};

struct Task {
  std::string text;  ///< the goal in one line, for the trainee; at most kMaxTaskText bytes of plain text
  std::variant<FindTask, PressTask, TraceTask> goal;

  bool operator==(const Task&) const = default;
};

inline constexpr std::size_t kMaxTaskText = 160, kMaxLinePoints = 48;
inline constexpr double kMaxTaskForceN = 100, kMaxTaskTimeS = 600, kMaxToleranceM = 0.1;

/// Returns "find", "press" or "trace".
const char* kind_of(const Task& task);

}  // namespace palpate
