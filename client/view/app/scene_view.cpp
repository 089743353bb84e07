#include "client/view/app/scene_view.hpp"

#include <fmt/format.h>

namespace palpate {

bool SceneView::update(ViewSession& session, float aspect, const ToolView* own) {
  ViewCore& core = session.core();
  if (!core.show(now_us(), moment_)) return false;
  if (own != nullptr) {
    std::erase_if(moment_.tools, [own](const ToolView& tool) { return tool.station == own->station; });
    moment_.tools.insert(moment_.tools.begin(), *own);
  }
  if (core.mesh_version() != mesh_version_) {
    mesh_version_ = core.mesh_version();
    scales_ = {};
    fit(session, aspect);
  }
  scales_.see(core.mesh().triangles, moment_.shape.positions, core.rest(), moment_.shape.shade, moment_.tools);
  remember(core.room());
  return true;
}

void SceneView::remember(const RoomView& room) {
  const Micros now = now_us();
  for (const ToolView& tool : moment_.tools) forces_.add(now, tool.station, static_cast<float>(tool.force.norm()));
  for (const StationView& station : room.stations)
    patch_ages_.add(now, station.station, static_cast<float>(1e3 * seconds(station.patch_age)));
  forces_.forget(now);
  patch_ages_.forget(now);
}

void SceneView::fit(ViewSession& session, float aspect) {
  if (session.core().ready()) camera_.fit(session.core().mesh().triangles, session.core().rest(), aspect);
}

Sight SceneView::sight(ViewSession& session) const {
  const ViewCore& core = session.core();
  if (!core.ready() || moment_.shape.positions.size() != core.rest().size()) return {};
  return {.triangles = core.mesh().triangles,
          .positions = moment_.shape.positions,
          .rest = core.rest(),
          .shade = moment_.shape.shade,
          .vertices = core.mesh().vertices,
          .tools = moment_.tools,
          .color_max = scales_.color_max(!moment_.shape.shade.empty()),
          .arrow_m_per_n = scales_.arrow_m_per_n()};
}

Caption SceneView::caption(ViewSession& session, const std::string& keys) const {
  const ViewCore& core = session.core();
  if (core.link() == ViewLink::refused) return {"refused", core.refusal(), keys};
  if (!core.ready()) return {"palpate", "waiting for " + session.server(), keys};
  Caption caption{core.welcome().scene, "server lost, showing its last shape", keys};
  caption.panels = {&core.room(), &forces_, &patch_ages_, {}, now_us()};
  for (const ToolView& tool : moment_.tools) caption.panels.stations.push_back(tool.station);
  if (core.link() != ViewLink::joined) return caption;
  caption.status =
      fmt::format("{:.0f} shapes a second, shown {:.0f} ms late    {} triangles", 1 / seconds(core.playback().period()),
                  1e3 * seconds(core.playback().delay()), core.mesh().triangles.size());
  return caption;
}

}  // namespace palpate
