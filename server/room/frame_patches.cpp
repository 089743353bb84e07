#include "server/room/frame_patches.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/wire/codec.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/reduction/tool_prediction.hpp"

namespace palpate {
namespace {

/// Returns how far a tool gets by a hand's acceleration in any direction, and the body towards it. `touches`: true if a sphere of
/// the tool does.
double sudden_way_m(double time_s, bool touches) {
  constexpr double kMarginM = 0.005;  // more: patches that nobody needs
  constexpr double kMarginTouchingM = 0.001;
  if (!touches) return 0.5 * kHandAccelerationMostMs2 * time_s * time_s + kMarginM;
  return kMarginTouchingM + accelerated_distance(time_s);
}

}  // namespace

FramePatches::FramePatches(SteppedBody& body)
    : body_(&body),
      frame_model_(std::make_unique<FrameModel>(body.dynamics(), body.skin(), body.softest_1_s2())),
      prediction_(std::in_place, body) {}

void FramePatches::renew() {
  auto next = std::make_unique<FrameModel>(body_->dynamics(), body_->skin(), body_->softest_1_s2());
  next->succeed(*frame_model_, body_->parted() ? std::span(body_->parted()->node_before) : std::span<const std::uint32_t>());
  frame_model_ = std::move(next);
  prediction_.emplace(*body_);
  for (auto& [id, station] : stations_) station.modes = {};
  drop_cached();
}

void FramePatches::drop_cached() {
  for (auto& [id, station] : stations_) station.cached.reset();
}

std::vector<StationFrame> FramePatches::build(const FrameJob& job, bool failed) {
  sync_stations(job);
  std::vector<StationFrame> frames(job.stations.size());
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k].id = job.stations[k].id;
  if (failed) return frames;
  Micros mean_horizon{};
  for (const StationJob& j : job.stations) mean_horizon += j.horizon / static_cast<std::int64_t>(job.stations.size());
  begin_model(job, mean_horizon);
  // All requests are known before the first patch is built, since the patches of a frame share computations.
  std::vector<Task> tasks;
  bool predicts = false;
  for (const StationJob& j : job.stations) {
    const Task& task = tasks.emplace_back(task_of(j));
    predicts |= task.builds && j.scheme == Scheme::hyper;
  }
  body_->predict_paths();
  frame_model_->enter(BuildPhase::rollouts);
  if (predicts && job.rollouts) frame_model_->set_predicted_states(prediction_->states(mean_horizon));
  frame_model_->enter(BuildPhase::other);
  for (std::size_t k = 0; k < frames.size(); ++k) frames[k] = frame_of(tasks[k], job.target);
  if (job.state)
    for (std::size_t k = 0; k < frames.size(); ++k)
      if (!tasks[k].parts.empty()) frames[k].needle = needle_in_body(body_->ports()[tasks[k].parts.front()]);
  return frames;
}

Matrix FramePatches::modes(StationId id) const {
  const auto station = stations_.find(id);
  return station == stations_.end() ? Matrix() : station->second.modes.of_nodes();
}

void FramePatches::sync_stations(const FrameJob& job) {
  for (const StationJob& j : job.stations) stations_.try_emplace(j.id);
  std::erase_if(stations_, [&](const auto& entry) {
    return std::none_of(job.stations.begin(), job.stations.end(), [&](const StationJob& j) { return j.id == entry.first; });
  });
}

bool FramePatches::CachedPatch::serves(const PatchRequest& asked, const ToolAt& tool) const {
  // At least five times a hand's tremor (client/device/hand.hpp), and less than the spacing of the nodes; more: older patches.
  constexpr double kCachedToolM = 0.001, kCachedAheadM = 0.005, kCachedHorizonShare = 0.1;
  const double horizon_s = seconds(asked.horizon);
  return asked.scheme == request.scheme && asked.order == request.order && asked.silence == request.silence &&
         std::abs(horizon_s - seconds(request.horizon)) <= kCachedHorizonShare * horizon_s &&
         (tool.position - patch.tool).norm() <= kCachedToolM &&
         horizon_s * (tool.velocity - patch.tool_velocity).norm() <= kCachedAheadM;
}

void FramePatches::begin_model(const FrameJob& job, Micros mean_horizon) {
  const std::vector<ToolPort>& ports = body_->ports();
  std::vector<ToolAt> tools;
  std::vector<HandMotion> hands;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    tools.push_back(body_->tool(k, job.target));
    // A patch's forces are linearised about the velocity that the body felt.
    if (ports[k].kind == ContactKind::attach) tools[k].velocity = at_node(body_->state().v, ports[k].node);
    hands.push_back(body_->predictable_motion(k));
  }
  frame_model_->begin(body_->state(), ports, tools, mean_horizon);
  frame_model_->set_hands(std::move(hands));
}

FramePatches::Task FramePatches::task_of(const StationJob& job) {
  Task task;
  task.job = &job;
  task.station = &stations_.at(job.id);
  task.parts = body_->ports_of(job);
  if (task.parts.empty()) return task;
  choose_port(task, job.horizon);
  if (!task.port || !job.wants_patch) return task;
  const Scene& scene = body_->scene();
  const ToolSpec& tool = body_->spec_of(job);
  task.request = {job.scheme,
                  job.order,
                  job.horizon,
                  job.silence,
                  [](int modes, bool loaded, int branches, PatchContacts contacts) {
                    return max_port_vertices(modes, kMaxPortTriangles, loaded, branches, contacts);
                  },
                  body_->hand_motion(*task.port).acceleration,
                  max_port_modes(tool.contact, static_cast<int>(scene.body.relaxation.size()))};
  const std::optional<CachedPatch>& cached = task.station->cached;
  task.reuses = body_->asleep() && cached && !tool.has_body() && cached->serves(task.request, frame_model_->tool(*task.port));
  task.builds = !task.reuses;
  if (task.builds) {
    const ExpectedSlide slide = expected_slide(body_->dynamics(), task.request);
    frame_model_->request_patch(*task.port, slide);
    // The other contacts of a tool slide with it.
    for (const std::size_t k : task.parts)
      if (k != *task.port && frame_model_->is_wanted(k) && slide.from_rest) frame_model_->request_patch(k, {slide.time_s});
  }
  return task;
}

/// Chooses the port at which the patch is made, and moves those of the tool that do not touch to the nearest point of the
/// surface. Those of a body that are in reach, and the path of a needle, are requested: the patch has their contacts, too.
void FramePatches::choose_port(Task& task, Micros horizon) {
  const bool touches = std::ranges::any_of(task.parts, [&](std::size_t k) { return body_->ports()[k].touching; });
  const double sudden_m = sudden_way_m(seconds(horizon), touches);
  std::pair<double, double> best{-1, 0};  // force, minus height
  for (const std::size_t k : task.parts) {
    const ToolPort& port = body_->ports()[k];
    if (port.needle.part == NeedlePart::shaft) {
      if (task.port && task.job->wants_patch) frame_model_->request_patch(k);
      continue;
    }
    const bool holds = port.kind == ContactKind::attach || port.touching;
    const std::optional<double> height = holds ? 0 : height_in_reach(k, horizon, sudden_m);
    if (!height) continue;
    if (task.parts.size() > 1 && task.job->wants_patch) frame_model_->request_patch(k);
    const std::pair worth{holds ? port.lambda.norm() : 0.0, -*height};
    if (task.port && worth <= best) continue;
    best = worth;
    task.port = k;
  }
}

/// Returns the height of a tool that does not touch above the surface, if it may meet it before the next patch: by its speed and
/// `sudden_m`.
std::optional<double> FramePatches::height_in_reach(std::size_t port, Micros horizon, double sudden_m) {
  const ToolAt& tool = frame_model_->tool(port);
  const double radius_m = body_->ports()[port].sphere.radius_m;
  const double reach = tool.velocity.norm() * seconds(horizon) + sudden_m + radius_m;
  const auto nearest = body_->nearest_within(port, tool.position, reach);
  if (!nearest) return std::nullopt;
  body_->move_point(port, nearest->point);
  return nearest->height_m - radius_m;
}

StationFrame FramePatches::frame_of(const Task& task, Micros stamp) {
  const StationJob& job = *task.job;
  StationFrame frame;
  frame.id = job.id;
  if (task.parts.empty()) {
    give_fading_force(job, stamp, frame);
  } else {
    frame.tool = frame_model_->tool(task.parts.front()).position;
    if (body_->spec_of(job).has_body()) frame.tool = body_->tool_of(job)->track.at(stamp).position;
    for (const std::size_t k : task.parts) {
      const ToolPort& port = body_->ports()[k];
      if (port.kind != ContactKind::attach && !port.touching) continue;
      frame.contact = true;
      const Vec3 normal = port.body ? frame_model_->normal(k) : Vec3(Vec3::Zero());
      const Wrench wrench = wrench_of(port, body_->tool_of(job)->track.turning(stamp), normal);
      frame.force += wrench.force;
      frame.torque += wrench.torque;
    }
    const TurningTool turning = body_->tool_of(job)->track.turning(stamp);
    frame.turn = turning.turn;
    frame.opening = turning.opening;
    if (task.builds || task.reuses) give_patch(task, frame);
  }
  if (!frame.patch) return frame;
  frame.patch->seq = ++task.station->seq;
  frame.patch->stamp = stamp;
  if (task.port && job.deadband > 0 && job.shadow_of == 0)
    frame.renewed_from = task.station->deadband.pass(*frame.patch, frame.terms,
                                                     {job.deadband, job.horizon, job.playing, &body_->tool_of(job)->track});
  return frame;
}

void FramePatches::give_patch(const Task& task, StationFrame& frame) {
  Station& station = *task.station;
  if (task.reuses) {
    frame.patch = station.cached->patch;
    frame.patch->tool = frame_model_->tool(*task.port).position;
    frame.patch->tool_velocity = frame_model_->tool(*task.port).velocity;
    frame.terms = station.cached->terms;
    return;
  }
  station.cached.reset();
  auto built = build_patch(*frame_model_, *task.port, task.request);
  if (!built) return;
  frame.patch = std::move(built->patch);
  leave_room_for_rounding(*frame.patch);
  if (body_->ports()[*task.port].body) set_pose(task, frame);
  frame.terms = std::move(built->terms);
  station.modes = std::move(built->modes);
  if (body_->asleep()) station.cached = CachedPatch{task.request, *frame.patch, frame.terms};
}

/// A tool with a body: its pose in place of the sphere at which the patch was made, and the forces of all its spheres.
void FramePatches::set_pose(const Task& task, StationFrame& frame) const {
  const TurningTool tool = body_->tool_of(*task.job)->track.turning(body_->time());
  frame.patch->tool = frame.tool;
  frame.patch->tool_velocity = tool.at.velocity;
  frame.patch->turn = tool.turn;
  frame.patch->opening = tool.opening;
  frame.patch->force = frame.force;
  frame.patch->torque = frame.torque;
}

/// Builds a patch for a station whose tool was released. The hand-over between patches hides the steps from frame to frame.
void FramePatches::give_fading_force(const StationJob& job, Micros stamp, StationFrame& frame) {
  const SteppedBody::StationTool* const station = body_->tool_of(job);
  if (!station) return;
  const ToolAt tool = station->track.at(stamp);
  frame.tool = tool.position;
  if (!station->fade) return;
  frame.released = station->costly;
  Patch& patch = frame.patch.emplace();
  patch.scheme = Scheme::hold;
  patch.contact = body_->spec_of(job).contact;
  patch.constant = true;
  patch.force = station->fade->force.at(stamp);
  if (body_->spec_of(job).has_body()) {
    patch.turn = station->track.turning(stamp).turn;
    patch.torque = station->fade->torque.at(stamp);
  }
  patch.tool = tool.position;
  patch.tool_velocity = tool.velocity;
  patch.trust_radius_m = kWorldExtentM;
  patch.valid_for = 2 * job.horizon + job.silence;
}

}  // namespace palpate
