#include "client/view/app/scene_view.hpp"

#include <fmt/format.h>

namespace palpate {

bool SceneView::update(ViewSession& session, float aspect) {
  ViewCore& core = session.core();
  if (!core.show(now_us(), moment_)) return false;
  if (core.mesh_version() != mesh_version_) {
    mesh_version_ = core.mesh_version();
    scales_ = {};
    fit(session, aspect);
  }
  scales_.see(core.triangles(), moment_.positions, core.rest(), moment_.tools);
  return true;
}

void SceneView::fit(ViewSession& session, float aspect) {
  if (session.core().ready()) camera_.fit(session.core().triangles(), session.core().rest(), aspect);
}

Sight SceneView::sight(ViewSession& session) const {
  const ViewCore& core = session.core();
  if (!core.ready() || moment_.positions.size() != core.rest().size()) return {};
  return {.triangles = core.triangles(),
          .positions = moment_.positions,
          .rest = core.rest(),
          .tools = moment_.tools,
          .displacement_max_m = scales_.displacement_max_m(),
          .arrow_m_per_n = scales_.arrow_m_per_n()};
}

Caption SceneView::caption(ViewSession& session, const std::string& keys) const {
  const ViewCore& core = session.core();
  if (core.link() == ViewLink::refused) return {"refused", core.refusal(), keys};
  if (!core.ready()) return {"palpate", "waiting for " + session.server(), keys};
  if (core.link() != ViewLink::joined) return {core.welcome().scene, "server lost, showing its last shape", keys};
  const double period_s = seconds(core.playback().period());
  return {core.welcome().scene,
          fmt::format("{:.0f} shapes a second, shown {:.0f} ms late    {} triangles", 1 / period_s,
                      1e3 * seconds(core.playback().delay()), core.triangles().size()),
          keys};
}

}  // namespace palpate
