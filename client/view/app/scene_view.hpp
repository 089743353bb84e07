// Converts a view source to what the stage draws: moment, scales, camera, caption.
#pragma once

#include "client/view/app/view_source.hpp"
#include "client/view/patch_overlay.hpp"

namespace palpate {

class SceneView {
 public:
  SceneView(ViewSource& source, const Camera& camera) : source_(source), camera_(camera) {}
  /// Width over height of the picture, and the share of it that panels cover.
  struct Frame {
    float aspect = 1, covered = 0;
  };

  /// Fetches the moment that is due. Fits the camera to a new mesh. Returns false while there is nothing to draw. `own`: the tool
  /// of this viewer's own station as it is now, shown without the delay of shapes.
  bool update(Micros now, const Frame& frame, const ToolView* own = nullptr);
  /// Sets the prediction of a patch to show; nullptr: none. `frame`: the shape of the foresight's moment, nullptr if it is not
  /// available.
  void mark(const Foresight* foresight, const Shape* frame);
  /// Body time of the moment shown.
  Micros shown() const { return moment_.shape.body_time; }
  Sight sight() const;
  Caption caption(Micros now);
  void fit(const Frame& frame);
  Camera& camera() { return camera_; }
  ViewSource& source() { return source_; }

 private:
  ViewSource& source_;
  ViewMoment moment_;
  Scales scales_;
  Hues hues_;
  std::vector<Triangle> tissue_;  // all but those of threads
  DepthGauge gauge_;
  std::vector<float> depths_;
  std::vector<ToolShape> shapes_;  // of each tool
  std::vector<std::size_t> tool_hues_;
  Camera camera_;
  std::optional<Foresight> foresight_;
  std::vector<PatchPin> pins_;
  std::uint64_t mesh_version_ = 0;
  bool closed_ = false;
};

}  // namespace palpate
