#include "bindings/core/local_room.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/core/haptic_tick.hpp"
#include "common/base/error.hpp"
#include "common/base/limits.hpp"
#include "common/base/tool_pose.hpp"
#include "server/scene/tools.hpp"

namespace palpate {
namespace {

std::string names_of_schemes() {
  std::string names;
  for (const std::string_view name : kSchemeNames) names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

std::string in_words(const Vec3& position) {
  return "(" + std::to_string(position.x()) + ", " + std::to_string(position.y()) + ", " + std::to_string(position.z()) + ")";
}

void check(const LocalTool& tool, std::size_t ticks) {
  const std::string where = "path of tool " + std::to_string(tool.id);
  if (tool.id == 0) throw InputError(where, "has the id 0", "an id of at least 1");
  if (tool.path.empty() || tool.path.size() > kMaxStepTicks)
    throw InputError(where, "has " + std::to_string(tool.path.size()) + " poses", "1 to " + std::to_string(kMaxStepTicks));
  if (tool.path.size() != ticks)
    throw InputError(where, "has " + std::to_string(tool.path.size()) + " poses",
                     std::to_string(ticks) + ", as the path of the first tool");
  for (std::size_t k = 0; k < ticks; ++k) check_pose(tool.path[k], where + "[" + std::to_string(k) + "]");
}

}  // namespace

void check_pose(const ToolSample& pose, const std::string& where) {
  if (!in_world(pose.position))
    throw InputError(where, "is " + in_words(pose.position),
                     "finite coordinates within " + std::to_string(static_cast<int>(kWorldExtentM)) + " m");
  if (pose.orientation && !is_unit(*pose.orientation))
    throw InputError("orientation of " + where, "has the length " + std::to_string(pose.orientation->norm()),
                     "a quaternion of length 1");
  if (!(pose.opening >= 0 && pose.opening <= 1))
    throw InputError("opening of " + where, "is " + std::to_string(pose.opening), "0 to 1");
}

Scheme scheme_named(const std::string& name, const std::string& where) {
  if (const auto scheme = scheme_from_name(name)) return *scheme;
  throw InputError(where + " \"" + name + "\"", "is no scheme of a server", "one of " + names_of_schemes());
}

SchemeAsked scheme_asked(const std::string& name, const std::string& where) {
  if (name == kAutoName) return std::nullopt;
  if (const auto scheme = scheme_from_name(name)) return scheme;
  throw InputError(where + " \"" + name + "\"", "is no scheme of a server",
                   "one of " + std::string(kAutoName) + ", " + names_of_schemes());
}

LocalRoom::LocalRoom(const Scene& scene) : room_(scene) {
  kinds_.name = scene.name;
  kinds_.tool = scene.tool;
  kinds_.tools = scene.tools;
  room_.start(now_);
}

void LocalRoom::renew() {
  room_ = room_.at_rest();
  now_ = {};
  room_.start(now_);
  reset_ = false;
  tools_.clear();
}

FrameResult LocalRoom::step(std::span<const LocalTool> tools, const LocalStep& options) {
  if (tools.empty()) throw InputError("tools", "are none", "at least one, or a step without tools");
  if (kinds_.tool.contact == ContactKind::attach && tools.size() > 1)
    throw InputError("tools", "are " + std::to_string(tools.size()), "one, as the scene lets a tool grasp its one node");
  FrameJob job;
  const std::size_t ticks = tools.front().path.size();
  for (const LocalTool& tool : tools) check(tool, ticks);
  job.target = now_ + static_cast<std::int64_t>(ticks) * kTick;
  job.shapes = options.shape;
  std::set<StationId> after;
  for (const LocalTool& tool : tools) {
    StationJob station{.id = tool.id,
                       .scheme = options.scheme,
                       .order = options.order,
                       .horizon = options.horizon,
                       .samples = {},
                       .wants_patch = options.patches,
                       .held = tool_number(kinds_, tool.held, "tool " + std::to_string(tool.id))};
    const auto add = [&](Micros t, const ToolSample& pose) { station.samples.push_back(pose), station.samples.back().t = t; };
    if (!tools_.contains(tool.id)) add(now_, tool.path.front());
    for (std::size_t k = 0; k < ticks; ++k) add(now_ + static_cast<std::int64_t>(k + 1) * kTick, tool.path[k]);
    if (!after.insert(tool.id).second)
      throw InputError("tools", "have the id " + std::to_string(tool.id) + " twice", "ids that differ");
    job.stations.push_back(std::move(station));
  }
  tools_ = std::move(after);
  return run(std::move(job));
}

FrameResult LocalRoom::step_alone(std::size_t ticks, const LocalStep& options) {
  if (ticks == 0 || ticks > kMaxStepTicks)
    throw InputError("ticks", "is " + std::to_string(ticks), "1 to " + std::to_string(kMaxStepTicks));
  tools_.clear();
  FrameJob job;
  job.target = now_ + static_cast<std::int64_t>(ticks) * kTick;
  job.shapes = options.shape;
  return run(std::move(job));
}

FrameResult LocalRoom::run(FrameJob job) {
  job.begin = now_;
  job.reset = std::exchange(reset_, false);
  FrameResult result = room_.run(job);
  now_ = job.target;
  return result;
}

}  // namespace palpate
