// Vectors, time and identifiers shared by both ends. SI units everywhere; frame W (world) unless a name says otherwise.
#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <optional>

namespace palpate {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
/// Unaligned, so that what contains one has no alignment of its own.
using Rotation = Eigen::Quaternion<double, Eigen::DontAlign>;

/// Both an instant (since the clock's own epoch) and a duration; each use names its clock.
using Micros = std::chrono::microseconds;

inline double seconds(Micros t) { return static_cast<double>(t.count()) * 1e-6; }
inline Micros from_seconds(double s) { return Micros{static_cast<std::int64_t>(s * 1e6 + (s < 0 ? -0.5 : 0.5))}; }

using StationId = std::uint32_t;

/// R_WT of the tool's frame (tool_pose.hpp), of unit length; empty when the device has none.
using Orientation = std::optional<Rotation>;

/// One reading of the tool: its pose, opening and time, in the clock named by the user of the struct.
struct ToolSample {
  Micros t{};
  Vec3 position = Vec3::Zero();  ///< [m]
  Orientation orientation = {};
  double opening = 0;  ///< of its jaws (tool_shape.hpp): 0 closed to 1 wide open
};

}  // namespace palpate
