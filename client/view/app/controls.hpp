// What mouse and keys do in the window.
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
  /// A session, perhaps with a mouse that touches (else nullptr). Both outlive it.
  Controls(ViewSession& live, TouchStation* touch, const Look& look) : view_(live), look_(look), live_(&live), touch_(touch) {}
  /// A recording that is played.
  Controls(RecordedSource& replay, const Look& look) : view_(replay), look_(look), replay_(&replay) {}
  /// From now on the window's mouse and keys come here.
  void attach(GLFWwindow* window, const Stage& stage, float density);
  /// Tells the mouse's station where the pointer is; nothing without one.
  void aim();

  /// Shows what the patch of the mouse's station said of the frame that is shown, when that is wanted.
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
  /// The pointer over the picture.
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
  std::uint64_t hand_mesh_ = 0;  ///< version of the mesh that it knows
  Micros aimed_at_{};
  double last_x_ = 0, last_y_ = 0;
  bool scrubbing_ = false;
};

}  // namespace palpate
