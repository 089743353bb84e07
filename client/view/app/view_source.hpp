// The source of the viewer's picture: a server's room, or a recording of one.
#pragma once

#include "client/view/stage.hpp"
#include "client/viewer/hues.hpp"
#include "client/viewer/view_core.hpp"

namespace palpate {

class ViewSource {
 public:
  virtual ~ViewSource() = default;

  /// Lets time advance to `time`, handling what is due meanwhile. Returns at once when the process was asked to end.
  virtual void pump_until(Micros time) = 0;
  /// True when the mesh and at least one shape have arrived: there is something to draw.
  virtual bool ready() const = 0;
  virtual const BodyMesh& mesh() const = 0;
  /// Positions that displacement is measured from.
  virtual const std::vector<Vec3f>& rest() const = 0;
  /// Version of the mesh, another one for each topology.
  virtual std::uint64_t mesh_version() const = 0;
  /// Deformable bodies of a scene with several; empty for one, or until they have arrived.
  virtual std::span<const BodyName> bodies() const = 0;
  /// Rigid parts of the scene; empty until they have arrived.
  virtual std::span<const PartMesh> parts() const = 0;
  /// Version of the parts, 0 before there are any.
  virtual std::uint64_t parts_version() const = 0;
  /// Returns the moment to show at `now` in `moment`; false while there is none.
  virtual bool show(Micros now, ViewMoment& moment) = 0;
  /// Returns the body of a station's tool at the moment shown; empty: a point.
  virtual const ToolShape& tool_shape(const std::string& station) const = 0;
  /// Selects the quantity that colours show.
  virtual void show_channel(ShapeChannel channel) = 0;
  /// Initial scales for a new mesh.
  virtual Scales scales() const = 0;
  /// Colours of the stations that are known beforehand.
  virtual Hues hues() const = 0;
  /// Returns title, status and panels, but not the order of stations; `tools` as drawn at `now`.
  virtual Caption caption(Micros now, const std::vector<ToolView>& tools) = 0;
};

}  // namespace palpate
