#include "server/room/frame_patches.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/wire/codec.hpp"
#include "server/reduce/tool_prediction.hpp"

namespace palpate {

FramePatches::FramePatches(SteppedBody& body)
    : body_(&body), frame_model_(body.dynamics(), body.skin(), body.softest_1_s2()), prediction_(body, frame_model_) {}

void FramePatches::clear() {
  stations_.clear();
  prediction_.clear();
}

void FramePatches::forget_kept() {
  for (auto& [id, station] : stations_) station.kept.reset();
}

std::vector<StationFrame> FramePatches::build(const FrameJob& job, bool failed) {
  sync_stations(job);
  const std::vector<std::uint8_t> gets_patch = begin(job, failed);
  assert(gets_patch.size() == job.stations.size());
  std::vector<StationFrame> frames;
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    StationFrame& frame = frames.emplace_back();
    frame.id = job.stations[k].id;
    if (!failed) frame = frame_of(job.stations[k], job.target, gets_patch[k] != 0);
  }
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

bool FramePatches::Kept::serves(const PatchRequest& asked, const ToolAt& tool) const {
  // At least five times a hand's tremor (client/device/hand.hpp), and less than the spacing of the nodes; more: older patches.
  constexpr double kKeptToolM = 0.001, kKeptAheadM = 0.005, kKeptHorizonShare = 0.1;
  const double horizon_s = seconds(asked.horizon);
  return asked.scheme == request.scheme && asked.order == request.order && asked.silence == request.silence &&
         std::abs(horizon_s - seconds(request.horizon)) <= kKeptHorizonShare * horizon_s &&
         (tool.position - patch.tool).norm() <= kKeptToolM &&
         horizon_s * (tool.velocity - patch.tool_velocity).norm() <= kKeptAheadM;
}

PatchRequest FramePatches::request_of(const StationJob& job, std::size_t which) const {
  assert(which < body_->ports().size());
  const Scene& scene = body_->scene();
  return {job.scheme,
          job.order,
          job.horizon,
          job.silence,
          [](int modes, bool loaded, int branches, int others) {
            return max_port_vertices(modes, kMaxPortTriangles, loaded, branches, others);
          },
          body_->hand_motion(which).acceleration,
          max_port_modes(scene.tool.contact, job.scheme, static_cast<int>(scene.body.relaxation.size()))};
}

std::vector<std::uint8_t> FramePatches::begin(const FrameJob& job, bool failed) {
  const std::vector<ToolPort>& ports = body_->ports();
  std::vector<ToolAt> tools;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    tools.push_back(body_->tool(k, job.target));
    // A patch's forces are linearised about the velocity that the body felt.
    if (ports[k].kind == ContactKind::attach) tools[k].velocity = at_node(body_->state().v, ports[k].node);
  }
  Micros mean_horizon{};
  for (const StationJob& j : job.stations) mean_horizon += j.horizon / static_cast<std::int64_t>(job.stations.size());
  frame_model_.begin(body_->state(), ports, tools, mean_horizon);
  std::vector<HandMotion> hands;
  for (std::size_t k = 0; k < ports.size(); ++k) hands.push_back(body_->hand_motion(k));
  frame_model_.set_hands(std::move(hands));
  // All requests are known before the first patch is built, since the patches of a frame share computations.
  std::vector<std::uint8_t> gets_patch;
  for (const StationJob& j : job.stations) {
    const auto which = body_->port_of(j);
    gets_patch.push_back(!failed && which && in_reach(*which, j.horizon) && j.wants_patch);
    if (gets_patch.back() && !kept_for(j, *which))
      frame_model_.request_patch(*which, expected_slide(body_->dynamics(), request_of(j, *which)));
  }
  frame_model_.enter(BuildPhase::rollouts);
  collect_snapshots(job, gets_patch, mean_horizon);
  frame_model_.enter(BuildPhase::other);
  return gets_patch;
}

/// Moves the point of a tool that does not touch to the nearest point of the surface.
bool FramePatches::in_reach(std::size_t which, Micros horizon) {
  const ToolPort& port = body_->ports().at(which);
  if (port.kind == ContactKind::attach || port.touching) return true;
  // The distance that the tool can cover before the next patch: from its speed, plus a hand's acceleration in any direction.
  constexpr double kReachMarginM = 0.005;  // the body moves, too; more: patches that nobody needs
  const ToolAt& tool = frame_model_.tool(which);
  const double t = seconds(horizon);
  const double reach = tool.velocity.norm() * t + 0.5 * kHandAccelerationMostMs2 * t * t + kReachMarginM;
  const auto nearest = body_->nearest_within(
      which, tool.position, reach, [this]() -> const auto& { return frame_model_.positions(); });
  if (nearest) body_->move_point(which, nearest->point);
  return nearest.has_value();
}

void FramePatches::collect_snapshots(const FrameJob& job, const std::vector<std::uint8_t>& gets_patch, Micros horizon) {
  std::vector<std::size_t> feeling;
  for (std::size_t k = 0; k < job.stations.size(); ++k) {
    if (!gets_patch[k] || job.stations[k].scheme != Scheme::hyper) continue;
    const std::size_t which = *body_->port_of(job.stations[k]);
    if (!kept_for(job.stations[k], which)) feeling.push_back(which);
  }
  if (!feeling.empty() && job.rollouts) frame_model_.set_predicted_states(prediction_.states(feeling, horizon));
}

const FramePatches::Kept* FramePatches::kept_for(const StationJob& job, std::size_t which) const {
  const std::optional<Kept>& kept = stations_.at(job.id).kept;
  return body_->asleep() && kept && kept->serves(request_of(job, which), frame_model_.tool(which)) ? &*kept : nullptr;
}

void FramePatches::give_patch(const StationJob& job, std::size_t which, StationFrame& frame) {
  Station& station = stations_.at(job.id);
  if (const Kept* kept = kept_for(job, which)) {
    frame.patch = kept->patch;
    frame.patch->tool = frame_model_.tool(which).position;
    frame.patch->tool_velocity = frame_model_.tool(which).velocity;
    frame.terms = kept->terms;
    return;
  }
  station.kept.reset();
  const PatchRequest request = request_of(job, which);
  auto built = build_patch(frame_model_, which, request);
  if (!built) return;
  frame.patch = std::move(built->patch);
  leave_room_for_rounding(*frame.patch);
  frame.terms = std::move(built->terms);
  station.modes = std::move(built->modes);
  if (body_->asleep()) station.kept = Kept{request, *frame.patch, frame.terms};
}

/// Builds a patch for a station whose tool was released. The hand-over between patches hides the steps from frame to frame.
void FramePatches::give_fading_force(const StationJob& job, Micros stamp, StationFrame& frame) {
  const SteppedBody::StationTool* const station = body_->tool_of(job);
  if (!station) return;
  const ToolAt tool = station->track.at(stamp);
  frame.tool = tool.position;
  if (!station->let_go) return;
  Patch patch;
  patch.seq = ++stations_.at(job.id).seq;
  patch.stamp = stamp;
  patch.scheme = Scheme::hold;
  patch.contact = body_->scene().tool.contact;
  patch.constant = true;
  patch.force = station->let_go->felt(stamp);
  patch.tool = tool.position;
  patch.tool_velocity = tool.velocity;
  patch.trust_radius_m = kWorldExtentM;
  patch.valid_for = 2 * job.horizon + job.silence;
  frame.patch = patch;
}

StationFrame FramePatches::frame_of(const StationJob& job, Micros stamp, bool gets_patch) {
  StationFrame frame;
  frame.id = job.id;
  const auto which = body_->port_of(job);
  if (!which) {
    give_fading_force(job, stamp, frame);
    return frame;
  }
  const ToolPort& port = body_->ports()[*which];
  frame.tool = frame_model_.tool(*which).position;
  frame.contact = port.kind == ContactKind::attach || port.touching;
  frame.force = frame.contact ? Vec3(-port.lambda) : Vec3::Zero();
  if (!gets_patch) return frame;
  give_patch(job, *which, frame);
  if (!frame.patch) return frame;
  Station& station = stations_.at(job.id);
  frame.patch->seq = ++station.seq;
  frame.patch->stamp = stamp;
  if (job.deadband > 0 && job.shadow_of == 0)
    frame.renewed_from =
        station.deadband.pass(*frame.patch, frame.terms, {job.deadband, job.horizon, job.playing, &body_->tool_of(job)->track});
  return frame;
}

}  // namespace palpate
