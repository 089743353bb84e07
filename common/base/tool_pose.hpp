// How a tool is held and which of its buttons are pressed: what a device says beside where its tool point is.
//
// Orientations are R_WT, of unit length. T is the tool's frame: its origin is the tool point, z runs along the shaft from the tip
// to the hand, x is the side on which a stylus has its buttons. The identity is a stylus that stands upright, its tip down.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <optional>

#include "common/base/types.hpp"

namespace palpate {

/// Nothing: the device does not have one.
using Orientation = std::optional<Eigen::Quaterniond>;

/// Bit n: button n is pressed, from t on.
struct ButtonChange {
  Micros t{};
  std::uint32_t pressed = 0;
};

inline constexpr double kUnitLengthWithin = 1e-3;  ///< what a quaternion may lack or have too much as it comes over the wire
inline bool is_unit(const Eigen::Quaterniond& q) noexcept { return std::abs(q.norm() - 1) <= kUnitLengthWithin; }

/// A share `s` of the way from one to the other; the first where one of them is nothing.
inline Orientation orientation_between(const Orientation& from, const Orientation& to, double s) {
  return from && to ? from->normalized().slerp(s, to->normalized()) : from;
}

}  // namespace palpate
