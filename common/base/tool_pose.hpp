// Orientation and buttons of a tool: the readings of a device besides the position of the tool point.
//
// Orientations are R_WT, of unit length. T is the tool's frame: its origin is the tool point, z runs along the shaft from the tip
// to the hand, x is the side on which a stylus has its buttons. The identity is a stylus that stands upright, its tip down.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/base/rotation_vector.hpp"
#include "common/base/types.hpp"

namespace palpate {

/// State of the buttons from t on; bit n: button n is pressed.
struct ButtonChange {
  Micros t{};
  std::uint32_t pressed = 0;
};

inline constexpr double kUnitLengthWithin = 1e-3;  ///< tolerance for the length of a quaternion from the wire
inline bool is_unit(const Rotation& q) noexcept { return std::abs(q.norm() - 1) <= kUnitLengthWithin; }

/// Interpolates by the share `s` from one to the other; returns the first when one of them is empty.
inline Orientation orientation_between(const Orientation& from, const Orientation& to, double s) {
  return from && to ? Orientation(interpolate(from->normalized(), to->normalized(), s)) : from;
}

}  // namespace palpate
