// From the session to what the stage draws: moment, scales, camera, caption.
#pragma once

#include "client/view/app/session.hpp"
#include "client/view/stage.hpp"

namespace palpate {

class SceneView {
 public:
  /// Takes the moment that is due. The camera is fitted when a topology is new. False while there is nothing to draw.
  bool update(ViewSession& session, float aspect);
  Sight sight(ViewSession& session) const;
  Caption caption(ViewSession& session, const std::string& keys) const;
  void fit(ViewSession& session, float aspect);
  Camera& camera() { return camera_; }

 private:
  ViewMoment moment_;
  Scales scales_;
  Camera camera_;
  std::uint64_t mesh_version_ = 0;
};

}  // namespace palpate
