// A recorded motion of the tool point: positions over time, linear in between, held before the first and after the last. It may
// say how the tool is held too: orientations (common/base/tool_pose.hpp), turned evenly in between, and which buttons are pressed
// from a row on.
//
// File (CSV): header `t_s,x_m,y_m,z_m`, after which `qx,qy,qz,qw` (a quaternion, R_WT) may follow, and after these or without
// them `buttons` (a whole number; bit n: button n); then one row per reading in frame W, times from 0 on, strictly ascending, at
// any sampling. What does not fit is refused with file, line and what was expected.
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
inline constexpr double kMaxMotionS = 8'000;              ///< times in milliseconds are noticed, and replay fits into memory

struct MotionPoint {
  double t_s = 0;                ///< since the start of the motion
  Vec3 position = Vec3::Zero();  ///< [m]
};

/// How the tool is held in each point: both empty, or one entry a point.
struct MotionHolds {
  std::vector<Eigen::Quaterniond> orientations;  ///< R_WT
  std::vector<std::uint32_t> buttons;
};

class Motion {
 public:
  /// Throws InputError, with `name` as the place, unless there are at least two points, times are from 0 to kMaxMotionS and
  /// strictly ascending, and every coordinate lies within kWorldExtentM.
  explicit Motion(std::vector<MotionPoint> points, const std::string& name = "motion") : Motion(std::move(points), {}, name) {}
  /// Also unless every orientation is of unit length (within 0.001; it is made so) and holds are as many as points, or none.
  Motion(std::vector<MotionPoint> points, MotionHolds holds, const std::string& name = "motion");

  /// The tool rests at one place for `duration_s` (> 0).
  static Motion rest(const Vec3& position, double duration_s);

  Vec3 position(double t_s) const noexcept;
  Vec3 position(Micros t) const noexcept { return position(seconds(t)); }
  /// Nothing where the motion does not say it.
  Orientation orientation(Micros t) const noexcept;
  /// None where the motion does not say it.
  std::uint32_t buttons(Micros t) const noexcept;
  bool has_orientation() const noexcept { return !holds_.orientations.empty(); }
  /// Up to the last one that is ever pressed.
  int button_count() const noexcept;
  /// Time of the last row: from there on the tool rests.
  double duration_s() const noexcept { return points_.back().t_s; }
  Micros duration() const noexcept { return from_seconds(duration_s()); }
  std::span<const MotionPoint> points() const noexcept { return points_; }
  const MotionHolds& holds() const noexcept { return holds_; }

 private:
  std::vector<MotionPoint> points_;
  MotionHolds holds_;
};

/// Throws InputError when the file cannot be read or a row does not hold.
Motion read_motion(const std::filesystem::path& file);
/// The same from a stream; `name` stands for the file in errors.
Motion read_motion(std::istream& in, const std::string& name);

/// Writes the file that read_motion() reads back to the same bits. Throws InputError when it cannot be written.
void write_motion(const std::filesystem::path& file, const Motion& motion);

}  // namespace palpate
