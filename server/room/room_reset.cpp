// The body back to rest while hands are on it, without a step of any hand's force.
#include "server/room/room_state.hpp"

namespace palpate {

void Room::State::reset_body() {
  body.x = rest.x;
  body.history = rest.history;
  body.v.setZero();
  for (std::size_t k = 0; k < ports.size(); ++k) {
    const auto station = stations.find(port_owner[k]);
    if (station == stations.end()) continue;  // it left with this very frame
    const ToolPort& port = ports[k];
    const bool holds = port.kind == ContactKind::attach || port.touching;
    station->second.let_go = LetGo{from_seconds(body.time_s), holds ? Vec3(-port.lambda) : Vec3::Zero()};
  }
  ports.clear();
  port_owner.clear();
  asleep = false;
}

bool Room::State::stays_off(Station& station) {
  if (!station.let_go) return false;
  const Micros now = from_seconds(body.time_s);
  if (!station.let_go->over(now, scene.tool.contact, skin, body.x, station.track.at(now).position)) return true;
  station.let_go.reset();
  return false;
}

/// For a station whose tool is not on the body. The hand-over of patches hides the steps from frame to frame.
void Room::State::show_nothing(const StationJob& job, Micros stamp, StationFrame& frame) {
  const auto owner = stations.find(job.shadow_of != 0 ? job.shadow_of : job.id);
  if (owner == stations.end() || owner->second.track.empty()) return;
  const ToolAt tool = owner->second.track.at(stamp);
  frame.tool = tool.position;
  if (!owner->second.let_go) return;
  Patch patch;
  patch.seq = ++stations.at(job.id).seq;
  patch.stamp = stamp;
  patch.scheme = Scheme::hold;
  patch.contact = scene.tool.contact;
  patch.constant = true;
  patch.force = owner->second.let_go->felt(stamp);
  patch.tool = tool.position;
  patch.tool_velocity = tool.velocity;
  patch.trust_radius_m = kWorldExtentM;
  patch.valid_for = 2 * job.horizon + job.silence;
  frame.patch = patch;
}

}  // namespace palpate
