#include "server/scene/task.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/plain_text.hpp"
#include "common/patch/surface.hpp"
#include "server/scene/settings_fields.hpp"

namespace palpate {
namespace {

const std::string kTask = "task", kLine = "task.trace.line";

PressTask read_press(const SceneText& text, const schema::PressT& in) {
  const std::string path = kTask + ".press.";
  const PressTask press{required(text, path + "min_n", in.min_n, 0, kMaxTaskForceN, "N"),
                        required(text, path + "max_n", in.max_n, 0, kMaxTaskForceN, "N"),
                        required(text, path + "time_s", in.time_s, 0.1, kMaxTaskTimeS, "s")};
  if (press.min_n >= press.max_n)
    text.refuse(path + "max_n", fmt::format("{0}min_n is {1:g} and {0}max_n is {2:g}", path, press.min_n, press.max_n),
                "min_n below max_n");
  return press;
}

TraceSettings read_trace(const SceneText& text, const schema::TraceT& in) {
  TraceSettings trace;
  if (in.line.size() < 2 || in.line.size() > kMostStatedPoints)
    text.refuse(kLine, fmt::format("{} has {} points", kLine, in.line.size()), fmt::format("2 to {}", kMostStatedPoints));
  trace.line_m = places(text, kLine, in.line);
  text.in_range(kTask + ".trace.tolerance_m", in.tolerance_m, 1e-4, kMaxToleranceM, "m");
  trace.tolerance_m = in.tolerance_m;
  return trace;
}

FindSettings read_find(const SceneText& text, const schema::FindT& in, const std::optional<LumpSettings>& lump) {
  if (!lump) text.refuse(kTask + ".find", kTask + ".find has nothing to find", "a body.lump");
  return {in.within_m ? required(text, kTask + ".find.within_m", in.within_m, 1e-4, kMaxToleranceM, "m") : lump->radius_m};
}

std::string usual_text(const TaskSettings& task) {
  if (const auto* press = std::get_if<PressTask>(&task.goal))
    return fmt::format("Press with {:g} to {:g} N for {:g} s", press->min_n, press->max_n, press->time_s);
  if (const auto* trace = std::get_if<TraceSettings>(&task.goal))
    return fmt::format("Follow the line within {:g} mm, from the ring on", 1e3 * trace->tolerance_m);
  return "Find the lump: press a button while you touch the place above it";
}

/// The part of a surface that can move: of every other triangle a corner is free.
std::vector<Triangle> free_triangles(const LumpedBody& body) {
  std::vector<Triangle> free;
  for (const Triangle& t : body.triangles)
    if (std::any_of(t.begin(), t.end(), [&](std::uint32_t node) { return body.fixed[node] == 0; })) free.push_back(t);
  return free;
}

/// Distributes points along the stated ones, each on the surface.
std::vector<LinePoint> line_on(const Surface& surface, Positions x, const TraceSettings& trace, const SceneText& text) {
  std::vector<LinePoint> stated;
  double length_m = 0;
  for (std::size_t i = 0; i < trace.line_m.size(); ++i) {
    const NearestPoint near = nearest_point(surface.view(), x, trace.line_m[i]);
    const std::string path = at(kLine, i) + ".at_m";
    if (const double off_m = (near.position - trace.line_m[i]).norm(); off_m > kOffSurfaceMostM)
      text.refuse(path, fmt::format("{} is {:.1f} mm off the surface that can move", path, 1e3 * off_m),
                  fmt::format("at most {:g} mm; the nearest point of it is [{:.4f}, {:.4f}, {:.4f}]", 1e3 * kOffSurfaceMostM,
                              near.position.x(), near.position.y(), near.position.z()));
    stated.push_back({near.position, near.normal});
    if (i == 0) continue;
    const double step_m = (near.position - stated[i - 1].at).norm();
    if (step_m < 1e-3) text.refuse(path, fmt::format("{} is less than 1 mm from the point before it", path), "a point apart");
    length_m += step_m;
  }
  const double step_m = std::max(kLineStepM, length_m / static_cast<double>(kMaxLinePoints - stated.size()));
  std::vector<LinePoint> line{stated.front()};
  for (std::size_t i = 1; i < stated.size(); ++i) {
    const Vec3 &a = stated[i - 1].at, &b = stated[i].at;
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / step_m - 1e-6)));
    for (int k = 1; k <= steps; ++k) {
      const NearestPoint near = nearest_point(surface.view(), x, a + (b - a) * (static_cast<double>(k) / steps));
      const double moved_m = (near.position - line.back().at).norm();
      if (moved_m > 4 * step_m || line.back().normal.dot(near.normal) < 0)
        text.refuse(at(kLine, i), fmt::format("{} cannot be reached along the surface from the point before it", at(kLine, i)),
                    "points between them, on one side of the body");
      if (moved_m > 1e-5) line.push_back({near.position, near.normal});
    }
  }
  return line;
}

}  // namespace

std::optional<LumpSettings> read_lump(const SceneText& text, bool planar) {
  const auto& in = text.values().body->lump;
  if (!in) return std::nullopt;
  if (planar) text.refuse("body.lump", "body.lump is given for a sheet", "a body in three dimensions for it");
  return LumpSettings{vector(text, "body.lump.center_m", in->center_m, -kMaxCoordinateM, kMaxCoordinateM, "m"),
                      required(text, "body.lump.radius_m", in->radius_m, 1e-3, 1, "m"),
                      required(text, "body.lump.stiffness_ratio", in->stiffness_ratio, 0.01, 100, "")};
}

std::optional<TaskSettings> read_task_settings(const SceneText& text, const std::optional<LumpSettings>& lump) {
  const auto& in = text.values().task;
  if (!in) return std::nullopt;
  const int goals = (in->find ? 1 : 0) + (in->press ? 1 : 0) + (in->trace ? 1 : 0);
  if (goals != 1)
    text.refuse(kTask, kTask + (goals == 0 ? " states no goal" : " states more than one goal"), "one of find, press and trace");
  TaskSettings task;
  if (in->find) task.goal = read_find(text, *in->find, lump);
  if (in->press) task.goal = read_press(text, *in->press);
  if (in->trace) task.goal = read_trace(text, *in->trace);
  task.text = text.has(kTask + ".text") ? in->text : usual_text(task);
  if (task.text.empty() || task.text.size() > kMaxTaskText || !is_plain_text(task.text))
    text.refuse(kTask + ".text", fmt::format("1 to {} bytes of visible text on one line", kMaxTaskText));
  return task;
}

Task fit_task(const LumpedBody& body, const SceneSettings& settings, const SceneText& text) {
  const TaskSettings& task = *settings.task;
  if (const auto* press = std::get_if<PressTask>(&task.goal)) return {task.text, *press};
  if (settings.tool.contact != ContactKind::touch || body.triangles.empty())
    text.refuse(kTask, std::string(kTask) + " needs a surface that the tool touches",
                "tool.contact \"touch\" in three dimensions, or a task with press");
  const Surface surface(free_triangles(body), body.nodes.size());
  const Positions x{body.nodes.front().data(), 3 * body.nodes.size()};
  if (const auto* trace = std::get_if<TraceSettings>(&task.goal))
    return {task.text, TraceTask{line_on(surface, x, *trace, text), trace->tolerance_m}};
  const LumpSettings& lump = *settings.lump;
  return {task.text, FindTask{lump.center_m, nearest_point(surface.view(), x, lump.center_m).position, lump.radius_m,
                              std::get<FindSettings>(task.goal).within_m}};
}

}  // namespace palpate
