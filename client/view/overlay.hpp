// Text and figures over the picture: title, stations with their forces, labels at the arrows, legend of the colours, scale bars,
// panels, replay bar. Uses Dear ImGui without windows and without a platform backend, so it works with and without a display.
#pragma once

#include <optional>
#include <string>

#include "client/view/camera.hpp"
#include "client/view/panels.hpp"
#include "client/view/replay_bar.hpp"
#include "client/view/sight.hpp"
#include "client/viewer/task_watch.hpp"

namespace palpate {

struct Caption {
  std::string title;   ///< name of the scene
  std::string status;  ///< one line under it
  std::string keys;    ///< help at the bottom right, empty in pictures
  PanelFigures panels = {};
  const TaskWatch* task = nullptr;         ///< null, or without a task: none
  std::optional<ReplayState> replay = {};  ///< only for a recording
};

class Overlay {
 public:
  /// Needs a current OpenGL 3.3 context. `scale` 1 is for a picture 1280 pixels wide on an ordinary screen.
  explicit Overlay(float scale);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;
  /// Draws over the contents of the bound framebuffer.
  void draw(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width, int height);
  float scale() const { return scale_; }

 private:
  float scale_;
};

}  // namespace palpate
