// A recorded motion of the tool point: positions over time, linear in between, held before the first and after the last.
//
// File (CSV): header `t_s,x_m,y_m,z_m`, then one row per reading in frame W, times from 0 on, strictly ascending, at any
// sampling. What does not fit is refused with file, line and what was expected.
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <span>
#include <string>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

inline constexpr std::size_t kMaxMotionRows = 8'000'000;  ///< more than two hours at 1 kHz
inline constexpr double kMaxMotionS = 8'000;              ///< times in milliseconds are noticed, and replay fits into memory

struct MotionPoint {
  double t_s = 0;                ///< since the start of the motion
  Vec3 position = Vec3::Zero();  ///< [m]
};

class Motion {
 public:
  /// Throws InputError, with `name` as the place, unless there are at least two points, times are from 0 to kMaxMotionS and
  /// strictly ascending, and every coordinate lies within kWorldExtentM.
  explicit Motion(std::vector<MotionPoint> points, const std::string& name = "motion");

  /// The tool rests at one place for `duration_s` (> 0).
  static Motion rest(const Vec3& position, double duration_s);

  Vec3 position(double t_s) const noexcept;
  Vec3 position(Micros t) const noexcept { return position(seconds(t)); }
  /// Time of the last row: from there on the tool rests.
  double duration_s() const noexcept { return points_.back().t_s; }
  Micros duration() const noexcept { return from_seconds(duration_s()); }
  std::span<const MotionPoint> points() const noexcept { return points_; }

 private:
  std::vector<MotionPoint> points_;
};

/// Throws InputError when the file cannot be read or a row does not hold.
Motion read_motion(const std::filesystem::path& file);
/// The same from a stream; `name` stands for the file in errors.
Motion read_motion(std::istream& in, const std::string& name);

/// Writes the file that read_motion() reads back to the same bits. Throws InputError when it cannot be written.
void write_motion(const std::filesystem::path& file, const Motion& motion);

}  // namespace palpate
