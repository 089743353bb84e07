// Effects of mouse and keys in the window.
#pragma once

#include <memory>
#include <optional>

#include "client/view/app/recorded_source.hpp"
#include "client/view/app/scene_view.hpp"
#include "client/view/app/session.hpp"
#include "client/view/app/touch.hpp"
#include "client/view/pointer_tool.hpp"

struct GLFWwindow;

namespace palpate {

class Controls {
 public:
  /// Controls a session, with a mouse that touches or nullptr. Both outlive this object.
  Controls(ViewSession& live, TouchStation* touch, const Look& look, const Camera& camera)
      : view_(live, camera), look_(look), live_(&live), touch_(touch) {}
  /// Controls a recording that is played.
  Controls(RecordedSource& replay, const Look& look, const Camera& camera)
      : view_(replay, camera), look_(look), replay_(&replay) {}
  /// Connects the window's mouse and keys.
  void attach(GLFWwindow* window, const Stage& stage, float density);
  /// Passes the pointer's position to the mouse's station; no effect without one.
  void aim();

  /// Shows the prediction of the mouse station's patch for the displayed frame, when that is enabled.
  void mark_patch();

  SceneView& view() { return view_; }
  const Look& look() const { return look_; }
  const char* keys() const;
  SceneView::Frame frame() const;

 private:
  static Controls& of(GLFWwindow* window);
  void on_key(int key, int mods);
  void on_replay_key(int key);
  void on_button(bool pressed);
  void on_move(double x, double y);
  void on_scroll(float steps);
  void look_from(Camera::Side side);
  void turn_or_move(int key, bool move);
  bool held(int button) const;
  /// Returns the pointer's position in the picture.
  Pointer pointer() const;
  ReplayBar bar() const;

  SceneView view_;
  Look look_;
  ViewSession* live_ = nullptr;
  TouchStation* touch_ = nullptr;
  RecordedSource* replay_ = nullptr;
  GLFWwindow* window_ = nullptr;
  const Stage* stage_ = nullptr;
  float density_ = 1;
  std::optional<PointerTool> hand_;
  std::uint64_t hand_mesh_ = 0;  ///< version of the mesh that it uses
  Micros aimed_at_{};
  double last_x_ = 0, last_y_ = 0;
  bool scrubbing_ = false;
};

}  // namespace palpate
