// Who is in the room: tools come with their samples and go.
#include <algorithm>

#include "server/room/room_state.hpp"

namespace palpate {

void Room::State::take_samples(const FrameJob& job) {
  for (const StationJob& j : job.stations) {
    Station& station = stations[j.id];
    if (!station.builder) station.builder = std::make_unique<PatchBuilder>(dynamics, skin, softest_1_s2, &balanced);
    station.track.add(j.samples, from_seconds(body.time_s));
    station.track.forget_before(from_seconds(body.time_s) - Micros{100'000});
  }
  std::erase_if(stations, [&](const auto& entry) {
    return std::none_of(job.stations.begin(), job.stations.end(), [&](const StationJob& j) { return j.id == entry.first; });
  });
}

void Room::State::sync_ports(const FrameJob& job) {
  for (std::size_t k = 0; k < ports.size();) {
    if (stations.contains(port_owner[k])) {
      ++k;
      continue;
    }
    ports.erase(ports.begin() + static_cast<std::ptrdiff_t>(k));
    port_owner.erase(port_owner.begin() + static_cast<std::ptrdiff_t>(k));
  }
  for (const StationJob& j : job.stations) {
    Station& station = stations[j.id];
    const bool known = std::find(port_owner.begin(), port_owner.end(), j.id) != port_owner.end();
    if (known || j.shadow_of != 0 || station.track.empty() || stays_off(station)) continue;
    ToolPort port;
    port.kind = scene.tool.contact;
    port.node = scene.tool.node;
    port.parameters = {scene.tool.coupling_n_m, scene.tool.friction};
    if (port.kind == ContactKind::attach) {
      const Micros now = from_seconds(body.time_s);
      const Vec3 offset = body.x.segment<3>(3 * static_cast<Eigen::Index>(port.node)) - station.track.at(now).position;
      if (offset.norm() > kGraspReachM) continue;
      station.grasp = Grasp(now, offset);
    }
    ports.push_back(port);
    port_owner.push_back(j.id);
  }
}

std::optional<std::size_t> Room::State::port_of(const StationJob& job) const {
  const auto at = std::find(port_owner.begin(), port_owner.end(), job.shadow_of != 0 ? job.shadow_of : job.id);
  if (at == port_owner.end()) return std::nullopt;
  return static_cast<std::size_t>(at - port_owner.begin());
}

}  // namespace palpate
