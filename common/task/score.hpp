// The score of a hand in a training task, from 0 to 100. Everything that shows a score (viewer, instructor's page, palpate-lab
// summary and export, tests) computes it here, from the tool, the force on it and its buttons at the server's frames.
//
// Symbols: x_i position of the tool [m], f_i force on it [N], c_i contact, b_i buttons, at the times t_i [s], ascending. A sample
// holds until the next one, for at most kTaskHoldMostS.
//
//   find   The mark m is the first x_i with contact at which a button is pressed that was not pressed at the sample before.
//          d = distance of m from the segment from the lump's centre to the surface point above it
//          score = 100 min(1, max(0, (3 w - d) / (2 w))),   w = within_m: 100 up to d = w, 0 from d = 3 w on
//   press  T = longest time without a break with min_n <= |f_i| <= max_n
//          score = 100 min(1, T / time_s)
//   trace  s = reached length of the line, 0 at first. A sample with contact whose tool is within tolerance_m of the line at
//          arc length a, s <= a <= s + kStrideM, sets s = a; the end is reached at s >= L - tolerance_m, L the line's length.
//          q = share of the path with contact, from the first sample with s > 0 to the end, that lies within tolerance_m of the
//          line; a step of the path counts as within when both its ends are
//          score = 100 s / L q
//
// Distances from the line are measured along the surface at rest: the part of x_i - p along the normal n of the line at p is left
// out, as a tool that presses leaves the surface by its depth; beyond kDepthMostM it is not on the line at all.
//
// What a recording must hold: a task in its head, frames with tools (position, force, contact), buttons for `find`, resets.
// A reset of the body begins a new attempt; each is scored by itself. Forces are those of the server's body at its frames: what
// the hand felt between them does not count. A mark counts when the button is down at a frame, or pressed between two.
#pragma once

#include <optional>
#include <string>

#include "common/task/task.hpp"

namespace palpate {

inline constexpr double kTaskHoldMostS = 0.25, kStrideM = 0.01, kDepthMostM = 0.03;

struct TaskSample {
  double t_s = 0;
  Vec3 tool = Vec3::Zero(), force = Vec3::Zero();
  bool contact = false;
  std::uint32_t buttons = 0;  ///< buttons that were down at any time since the sample before; bit n: button n
};

struct TaskProgress {
  double score = 0;          ///< 0 to 100, if the attempt ended now
  double done = 0;           ///< share of the task that is done: of the time, of the line; find: 1 once there is a mark
  double time_s = 0;         ///< from the first contact to the end of the task, or to now
  bool in_band = false;      ///< press: the force is in the band; trace: the tool is on the line
  std::optional<Vec3> mark;  ///< find
  double miss_m = 0;         ///< find: d;  trace: largest distance from the line between its ends
  double held_s = 0;         ///< press: T
  double force_max_n = 0;    ///< largest |f| so far
  double traced_m = 0;       ///< trace: s
  double within = 1;         ///< trace: q

  bool finished() const { return done >= 1; }
};

/// Judges one hand in one attempt. Samples come in order; one that is not newer than the last is ignored.
class TaskScorer {
 public:
  /// `task` outlives the scorer.
  explicit TaskScorer(const Task& task) : task_(&task) {}
  void add(const TaskSample& sample);
  const TaskProgress& progress() const { return progress_; }
  /// True after the first contact.
  bool begun() const { return first_contact_s_.has_value(); }

 private:
  void add_to(const FindTask& find, const TaskSample& sample);
  void add_to(const PressTask& press, const TaskSample& sample);
  void add_to(const TraceTask& trace, const TaskSample& sample);

  const Task* task_;
  TaskProgress progress_;
  std::optional<TaskSample> last_;
  std::optional<double> first_contact_s_;
  double stretch_s_ = 0;                   ///< press: time in the band without a break
  double path_m_ = 0, path_within_m_ = 0;  ///< trace
  bool last_within_ = false;
};

/// Place on a line that is nearest to a point, along the surface.
struct LinePlace {
  double arc_m = 0;       ///< length of the line up to it
  double distance_m = 0;  ///< along the surface; infinite where the point is deeper or higher than kDepthMostM
};
/// Searches the arc lengths from `from_m` to `to_m`.
LinePlace nearest_on(const TraceTask& trace, const Vec3& point, double from_m, double to_m);
double length_of(const TraceTask& trace);

/// Returns the progress in a few words, as "held 1.2 of 3 s" or "marked 7 mm from the middle of the lump".
std::string in_words(const Task& task, const TaskProgress& progress);

}  // namespace palpate
