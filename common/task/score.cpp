#include "common/task/score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace palpate {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

double distance_from_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double share = std::clamp((p - a).dot(along) / std::max(along.squaredNorm(), 1e-18), 0.0, 1.0);
  return (p - a - share * along).norm();
}

}  // namespace

const char* kind_of(const Task& task) {
  constexpr const char* kNames[] = {"find", "press", "trace"};
  return kNames[task.goal.index()];
}

double length_of(const TraceTask& trace) {
  double length_m = 0;
  for (std::size_t i = 1; i < trace.line.size(); ++i) length_m += (trace.line[i].at - trace.line[i - 1].at).norm();
  return length_m;
}

LinePlace nearest_on(const TraceTask& trace, const Vec3& point, double from_m, double to_m) {
  LinePlace best{from_m, kFar};
  double begin_m = 0;
  for (std::size_t i = 1; i < trace.line.size() && begin_m <= to_m; ++i) {
    const LinePoint &a = trace.line[i - 1], &b = trace.line[i];
    const Vec3 along = b.at - a.at;
    const double length_m = along.norm(), end_m = begin_m + length_m;
    const Vec3 normal = (a.normal + b.normal).normalized();
    const double low = std::max(from_m - begin_m, 0.0), high = std::min(to_m - begin_m, length_m);
    begin_m = end_m;
    if (length_m <= 0 || low > high) continue;
    const Vec3 to_point = point - a.at, flat = to_point - normal.dot(to_point) * normal;
    const double at_m = std::clamp(flat.dot(along) / length_m, low, high);
    const Vec3 beside = to_point - along * (at_m / length_m);
    const double height_m = normal.dot(beside);
    if (std::abs(height_m) > kDepthMostM) continue;
    const double distance_m = (beside - height_m * normal).norm();
    if (distance_m < best.distance_m) best = {end_m - length_m + at_m, distance_m};
  }
  return best;
}

void TaskScorer::add(const TaskSample& sample) {
  if (progress_.finished() || (last_ && sample.t_s <= last_->t_s)) return;
  if (sample.contact && !first_contact_s_) first_contact_s_ = sample.t_s;
  if (first_contact_s_) progress_.time_s = sample.t_s - *first_contact_s_;
  progress_.force_max_n = std::max(progress_.force_max_n, sample.force.norm());
  std::visit([&](const auto& goal) { add_to(goal, sample); }, task_->goal);
  last_ = sample;
}

void TaskScorer::add_to(const FindTask& find, const TaskSample& sample) {
  const std::uint32_t before = last_ ? last_->buttons : 0;
  if (!sample.contact || (sample.buttons & ~before) == 0) return;
  progress_.mark = sample.tool;
  progress_.miss_m = distance_from_segment(sample.tool, find.lump, find.above);
  progress_.done = 1;
  progress_.score = 100 * std::clamp((3 * find.within_m - progress_.miss_m) / (2 * find.within_m), 0.0, 1.0);
}

void TaskScorer::add_to(const PressTask& press, const TaskSample& sample) {
  if (progress_.in_band) stretch_s_ += std::min(sample.t_s - last_->t_s, kTaskHoldMostS);
  progress_.held_s = std::max(progress_.held_s, stretch_s_);
  const double force_n = sample.force.norm();
  progress_.in_band = sample.contact && force_n >= press.min_n && force_n <= press.max_n;
  if (!progress_.in_band || sample.t_s - (last_ ? last_->t_s : sample.t_s) > kTaskHoldMostS) stretch_s_ = 0;
  progress_.done = std::min(1.0, progress_.held_s / press.time_s);
  progress_.score = 100 * progress_.done;
}

void TaskScorer::add_to(const TraceTask& trace, const TaskSample& sample) {
  progress_.in_band = false;
  if (!sample.contact) return;
  const double length_m = length_of(trace);
  const LinePlace ahead = nearest_on(trace, sample.tool, progress_.traced_m, progress_.traced_m + kStrideM);
  const LinePlace any = nearest_on(trace, sample.tool, 0, length_m);
  const bool had_begun = progress_.traced_m > 0;
  progress_.in_band = any.distance_m <= trace.tolerance_m;
  if (ahead.distance_m <= trace.tolerance_m) progress_.traced_m = std::max(progress_.traced_m, ahead.arc_m);
  if (had_begun) {
    if (last_ && last_->contact) {
      const double step_m = (sample.tool - last_->tool).norm();
      path_m_ += step_m;
      if (progress_.in_band && last_within_) path_within_m_ += step_m;
    }
    if (std::isfinite(any.distance_m)) progress_.miss_m = std::max(progress_.miss_m, any.distance_m);
  }
  last_within_ = progress_.in_band;
  if (progress_.traced_m >= length_m - trace.tolerance_m) progress_.traced_m = length_m;
  progress_.within = path_m_ > 0 ? path_within_m_ / path_m_ : 1;
  progress_.done = progress_.traced_m / length_m;
  progress_.score = 100 * progress_.done * progress_.within;
}

std::string in_words(const Task& task, const TaskProgress& p) {
  if (std::holds_alternative<FindTask>(task.goal))
    return p.mark ? fmt::format("marked {:.0f} mm from the middle of the lump", 1e3 * p.miss_m) : std::string("no mark yet");
  if (const auto* press = std::get_if<PressTask>(&task.goal))
    return fmt::format("held {:.1f} of {:.3g} s", std::min(p.held_s, press->time_s), press->time_s);
  const auto& trace = std::get<TraceTask>(task.goal);
  return fmt::format("{:.0f} of {:.0f} mm, {:.0f} % on the line", 1e3 * p.traced_m, 1e3 * length_of(trace), 100 * p.within);
}

}  // namespace palpate
