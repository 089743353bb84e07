#include "client/view/app/scene_view.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

bool SceneView::update(Micros now, const Frame& frame, const ToolView* own) {
  if (!source_.show(now, moment_)) return false;
  if (own != nullptr) {
    const auto shown = std::ranges::find(moment_.tools, own->station, &ToolView::station);
    ToolView tool = *own;
    if (shown != moment_.tools.end()) {
      tool.guides = shown->guides;
      moment_.tools.erase(shown);
    }
    moment_.tools.insert(moment_.tools.begin(), std::move(tool));
  }
  if (source_.mesh_version() != mesh_version_) {
    mesh_version_ = source_.mesh_version();
    scales_ = source_.scales();
    hues_ = source_.hues();
    closed_ = is_closed(source_.mesh().triangles);
    tissue_.clear();
    for (const Triangle& t : source_.mesh().triangles)
      if (!source_.mesh().vertices[t[0]].thread) tissue_.push_back(t);
    gauge_ = DepthGauge(tissue_, source_.rest());
    fit(frame);
  }
  hues_.see(moment_.tools);
  depths_.clear();
  for (const ToolView& tool : moment_.tools) depths_.push_back(tool.contact ? gauge_.at(tool.position) : 0);
  shapes_.clear();
  for (const ToolView& tool : moment_.tools) shapes_.push_back(source_.tool_shape(tool.station));
  tool_hues_ = hues_of(moment_.tools, hues_.stations());
  const Shape& shape = moment_.shape;
  scales_.see(tissue_, shape.positions, source_.rest(), moment_.tools, shape.channel, shape.scalars);
  return true;
}

void SceneView::mark(const Foresight* foresight, const Shape* frame) {
  pins_.clear();
  foresight_.reset();
  if (foresight == nullptr) return;
  foresight_ = *foresight;
  if (frame == nullptr || frame->positions.size() != moment_.shape.positions.size()) return;
  pins_ = pins_on(*foresight_, frame->positions, moment_.shape.positions);
  scales_.see_misses(pins_);
}

Caption SceneView::caption(Micros now) {
  Caption caption = source_.caption(now, moment_.tools);
  caption.panels.stations = hues_.stations();
  caption.panels.parts = source_.parts();
  caption.panels.foresight = foresight_ ? &*foresight_ : nullptr;
  return caption;
}

void SceneView::fit(const Frame& frame) {
  if (source_.ready()) camera_.fit(tissue_, source_.rest(), frame.aspect, frame.covered);
}

Sight SceneView::sight() const {
  if (!source_.ready() || moment_.shape.positions.size() != source_.rest().size()) return {};
  return {.triangles = source_.mesh().triangles,
          .positions = moment_.shape.positions,
          .rest = source_.rest(),
          .scalars = moment_.shape.scalars,
          .vertices = source_.mesh().vertices,
          .tools = moment_.tools,
          .shapes = shapes_,
          .depths = depths_,
          .hues = tool_hues_,
          .pins = pins_,
          .pin_triangles = foresight_ ? std::span<const Triangle>(foresight_->triangles) : std::span<const Triangle>(),
          .bodies = source_.bodies(),
          .parts = source_.parts(),
          .parts_version = source_.parts_version(),
          .color = moment_.shape.channel,
          .closed = closed_,
          .color_max = scales_.color_max(moment_.shape.channel),
          .arrow_m_per_n = scales_.arrow_m_per_n(),
          .miss_max_m = scales_.miss_max_m()};
}

}  // namespace palpate
