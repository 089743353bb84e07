// A recorded motion of the tool point: positions over time, linear in between, constant before the first and after the last. It
// may include the tool's pose: orientations (common/base/tool_pose.hpp) and openings of jaws, interpolated evenly, and buttons,
// each pressed from a row on.
//
// File (CSV): header `t_s,x_m,y_m,z_m`, optionally followed by `qx,qy,qz,qw` (a quaternion, R_WT), with or without them by
// `buttons` (a whole number; bit n: button n), and by `opening` (0 closed to 1 wide open); then one row per reading in frame W,
// times from 0, strictly ascending, at any sampling. Invalid input is refused with file, line and what was expected.
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/tool_pose.hpp"
#include "common/base/types.hpp"

namespace palpate {

inline constexpr std::size_t kMaxMotionRows = 8'000'000;  ///< more than two hours at 1 kHz
inline constexpr double kMaxMotionS = 8'000;              ///< rejects times in milliseconds, and lets replay fit into memory

struct MotionPoint {
  double t_s = 0;                ///< since the start of the motion
  Vec3 position = Vec3::Zero();  ///< [m]
};

/// Orientation, buttons and opening in each point: each list is empty, or has one entry a point.
struct MotionHolds {
  std::vector<Eigen::Quaterniond> orientations;  ///< R_WT
  std::vector<std::uint32_t> buttons;
  std::vector<double> openings;  ///< 0 to 1
};

class Motion {
 public:
  /// Throws InputError, with `name` as the place, unless there are at least two points, times are from 0 to kMaxMotionS and
  /// strictly ascending, and every coordinate lies within kWorldExtentM.
  explicit Motion(std::vector<MotionPoint> points, const std::string& name = "motion") : Motion(std::move(points), {}, name) {}
  /// Requires in addition that every orientation is of unit length (within 0.001; it is normalised), that openings are from 0 to
  /// 1, and that holds are as many as points, or none.
  Motion(std::vector<MotionPoint> points, MotionHolds holds, const std::string& name = "motion");

  /// Returns a motion that rests at one place for `duration_s` (> 0).
  static Motion rest(const Vec3& position, double duration_s);

  Vec3 position(double t_s) const noexcept;
  Vec3 position(Micros t) const noexcept { return position(seconds(t)); }
  /// Empty when the motion has no orientations.
  Orientation orientation(Micros t) const noexcept;
  /// Zero when the motion has no buttons.
  std::uint32_t buttons(Micros t) const noexcept;
  /// Zero when the motion has no openings.
  double opening(Micros t) const noexcept;
  bool has_orientation() const noexcept { return !holds_.orientations.empty(); }
  bool has_opening() const noexcept { return !holds_.openings.empty(); }
  /// Index of the last button that is ever pressed, plus one.
  int button_count() const noexcept;
  /// Time of the last row: the tool rests from then on.
  double duration_s() const noexcept { return points_.back().t_s; }
  Micros duration() const noexcept { return from_seconds(duration_s()); }
  std::span<const MotionPoint> points() const noexcept { return points_; }
  const MotionHolds& holds() const noexcept { return holds_; }

 private:
  std::vector<MotionPoint> points_;
  MotionHolds holds_;
};

/// Throws InputError when the file cannot be read or a row is invalid.
Motion read_motion(const std::filesystem::path& file);
/// Reads from a stream; `name` stands for the file in errors.
Motion read_motion(std::istream& in, const std::string& name);

/// Writes a file that read_motion() reads back to the same bits. Throws InputError when it cannot be written.
void write_motion(const std::filesystem::path& file, const Motion& motion);

}  // namespace palpate
