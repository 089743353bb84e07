// What is looked at: a server's room, or a recording of one.
#pragma once

#include "client/view/hues.hpp"
#include "client/view/stage.hpp"
#include "client/view/view_core.hpp"

namespace palpate {

class ViewSource {
 public:
  virtual ~ViewSource() = default;

  /// Lets time pass until then, with what is due meanwhile. Returns at once when the process was told to end.
  virtual void pump_until(Micros time) = 0;
  /// Mesh and at least one shape are here: there is something to draw.
  virtual bool ready() const = 0;
  virtual const BodyMesh& mesh() const = 0;
  /// What displacement is measured from.
  virtual const std::vector<Vec3f>& rest() const = 0;
  /// Grows with every new topology.
  virtual std::uint64_t mesh_version() const = 0;
  /// The moment to show at `now`; false while there is none.
  virtual bool show(Micros now, ViewMoment& moment) = 0;
  /// What colours are to show.
  virtual void show_channel(ShapeChannel channel) = 0;
  /// Scales to begin with for a new mesh.
  virtual Scales scales() const = 0;
  /// Colours of the stations that are known beforehand.
  virtual Hues hues() const = 0;
  /// Title, status, panels but for the order of stations; `tools` as they are drawn at `now`.
  virtual Caption caption(Micros now, const std::vector<ToolView>& tools) = 0;
};

}  // namespace palpate
