// Every station gets what it needs to feel the body until the next frame.
#include <cassert>

#include "common/wire/codec.hpp"
#include "server/room/hand_rollouts.hpp"
#include "server/room/room_state.hpp"

namespace palpate {

PatchRequest Room::State::request_of(const StationJob& job, std::size_t which) const {
  assert(which < port_owner.size());
  return {job.scheme,
          job.order,
          job.horizon,
          job.silence,
          [](int modes, bool loaded, int branches) { return max_port_vertices(modes, kMaxPortTriangles, loaded, branches); },
          hand_acceleration(stations.at(port_owner[which])),
          max_port_modes(scene.tool.contact, job.scheme, static_cast<int>(scene.body.relaxation.size()))};
}

std::vector<std::uint8_t> Room::State::begin_patches(const FrameJob& job) {
  std::vector<ToolAt> tools;
  for (std::size_t k = 0; k < ports.size(); ++k) {
    tools.push_back(tool_at(stations.at(port_owner[k]), job.target));
    // The velocity that the body felt: a patch's forces hold for it.
    if (ports[k].kind == ContactKind::attach) tools[k].velocity = body.v.segment<3>(3 * static_cast<Eigen::Index>(ports[k].node));
  }
  Micros mean_horizon{};
  for (const StationJob& j : job.stations) mean_horizon += j.horizon / static_cast<std::int64_t>(job.stations.size());
  frame_model.begin(body, ports, tools, mean_horizon);
  // Known for all before the first patch is built: what the patches of a frame have in common is computed together.
  std::vector<std::uint8_t> gets_patch;
  for (const StationJob& j : job.stations) {
    const auto which = port_of(j);
    gets_patch.push_back(which && in_reach(*which, j.horizon) && j.wants_patch);
    if (gets_patch.back() && !kept_for(j, *which))
      frame_model.want(*which, stations.at(j.id).builder->expected_slide(request_of(j, *which)));
  }
  frame_model.enter(PatchPart::rollouts);
  collect_snapshots(job, gets_patch, mean_horizon);
  frame_model.enter(PatchPart::other);
  return gets_patch;
}

/// Moves the point of a tool that does not touch to where it is nearest.
bool Room::State::in_reach(std::size_t which, Micros horizon) {
  assert(which < ports.size() && ports.size() == port_owner.size());
  ToolPort& port = ports[which];
  if (port.kind == ContactKind::attach || port.touching) return true;
  // How far the tool can get before the next patch: its speed, and a hand's acceleration on top, each way.
  constexpr double kReachMarginM = 0.005;  // the body moves, too; more: patches that nobody needs
  const ToolAt& tool = frame_model.tool(which);
  const double t = seconds(horizon);
  const double reach = tool.velocity.norm() * t + 0.5 * kHandAccelerationMostMs2 * t * t + kReachMarginM;
  const auto nearest = nearest_within(
      which, tool.position, reach, [this]() -> const auto& { return frame_model.positions(); });
  if (nearest) port.point = nearest->point;
  return nearest.has_value();
}

const Room::State::Kept* Room::State::kept_for(const StationJob& job, std::size_t which) const {
  const std::optional<Kept>& kept = stations.at(job.id).kept;
  return asleep && kept && kept->serves(request_of(job, which), frame_model.tool(which)) ? &*kept : nullptr;
}

void Room::State::give_patch(const StationJob& job, std::size_t which, StationFrame& frame) {
  assert(which < ports.size());
  Station& station = stations.at(job.id);
  if (const Kept* kept = kept_for(job, which)) {
    frame.patch = kept->patch;
    frame.patch->tool = frame_model.tool(which).position;
    frame.patch->tool_velocity = frame_model.tool(which).velocity;
    frame.terms = kept->terms;
    return;
  }
  station.kept.reset();
  const PatchRequest request = request_of(job, which);
  auto built = station.builder->build(frame_model, which, request);
  if (!built) return;
  frame.patch = std::move(built->patch);
  leave_room_for_rounding(*frame.patch);
  frame.terms = std::move(built->terms);
  station.modes = std::move(built->modes);
  if (asleep) station.kept = Kept{request, *frame.patch, frame.terms};
}

StationFrame Room::State::frame_of(const StationJob& job, Micros stamp, bool gets_patch) {
  StationFrame frame;
  frame.id = job.id;
  const auto which = port_of(job);
  if (!which) {
    show_nothing(job, stamp, frame);
    return frame;
  }
  const ToolPort& port = ports[*which];
  frame.tool = frame_model.tool(*which).position;
  frame.contact = port.kind == ContactKind::attach || port.touching;
  frame.force = frame.contact ? Vec3(-port.lambda) : Vec3::Zero();
  if (!gets_patch) return frame;
  give_patch(job, *which, frame);
  if (!frame.patch) return frame;
  Station& station = stations.at(job.id);
  frame.patch->seq = ++station.seq;
  frame.patch->stamp = stamp;
  if (job.deadband > 0 && job.shadow_of == 0)
    frame.renewed_from =
        station.deadband.pass(*frame.patch, frame.terms, {job.deadband, job.horizon, job.playing, &station.track});
  return frame;
}

}  // namespace palpate
