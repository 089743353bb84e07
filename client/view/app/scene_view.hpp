// From the session to what the stage draws: moment, scales, camera, caption.
#pragma once

#include "client/view/app/session.hpp"
#include "client/view/stage.hpp"

namespace palpate {

class SceneView {
 public:
  /// Takes the moment that is due. The camera is fitted when a mesh is new. False while there is nothing to draw. `own` is the
  /// tool of this viewer's own station, as it is now: shown without the delay of shapes.
  bool update(ViewSession& session, float aspect, const ToolView* own = nullptr);
  Sight sight(ViewSession& session) const;
  Caption caption(ViewSession& session, const std::string& keys) const;
  void fit(ViewSession& session, float aspect);
  Camera& camera() { return camera_; }
  const Scales& scales() const { return scales_; }

 private:
  void remember(const RoomView& room);

  ViewMoment moment_;
  Scales scales_;
  Camera camera_;
  History forces_, patch_ages_;
  std::uint64_t mesh_version_ = 0;
};

}  // namespace palpate
