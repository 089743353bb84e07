#include "client/view/app/controls.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>

namespace palpate {
namespace {

constexpr const char* kLookKeys =
    "drag turn   right drag move   wheel zoom   F fit   T 1 3 2 sides   L light   W lines   C colours   P panels   R record   X "
    "body "
    "to rest   Q quit";
constexpr const char* kTouchKeys =
    "left button touch   wheel deeper   M mark   right drag turn   middle drag move   F fit   L light   W lines   "
    "C colours   N next frame   P panels   R record   X body to rest   Q quit";
constexpr const char* kReplayKeys =
    "space play   , . frame   [ ] speed   page 5 s   home end   drag turn   F fit   L light   W lines   P panels   Q quit";

template <class Choice>
Choice next_of(Choice choice, int count) {
  return static_cast<Choice>((static_cast<int>(choice) + 1) % count);
}

}  // namespace

Controls& Controls::of(GLFWwindow* window) { return *static_cast<Controls*>(glfwGetWindowUserPointer(window)); }

void Controls::attach(GLFWwindow* window, const Stage& stage, float density) {
  window_ = window;
  stage_ = &stage;
  density_ = density;
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
    if (action != GLFW_RELEASE) of(w).on_key(key, mods);
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    if (button == GLFW_MOUSE_BUTTON_LEFT) of(w).on_button(action == GLFW_PRESS);
  });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { of(w).on_move(x, y); });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) { of(w).on_scroll(static_cast<float>(steps)); });
}

const char* Controls::keys() const { return touch_ != nullptr ? kTouchKeys : replay_ != nullptr ? kReplayKeys : kLookKeys; }

SceneView::Frame Controls::frame() const {
  int width = 1, height = 1;
  glfwGetFramebufferSize(window_, &width, &height);
  width = std::max(1, width);
  height = std::max(1, height);
  return {static_cast<float>(width) / static_cast<float>(height), covered_by_panels(look_, width, height, density_)};
}

bool Controls::held(int button) const { return glfwGetMouseButton(window_, button) == GLFW_PRESS; }

Pointer Controls::pointer() const {
  int width = 1, height = 1, pixels_x = 1, pixels_y = 1;
  glfwGetWindowSize(window_, &width, &height);
  glfwGetFramebufferSize(window_, &pixels_x, &pixels_y);
  return {static_cast<float>(last_x_ * pixels_x / std::max(1, width)),
          static_cast<float>(last_y_ * pixels_y / std::max(1, height)), static_cast<float>(std::max(1, pixels_x)),
          static_cast<float>(std::max(1, pixels_y)), held(GLFW_MOUSE_BUTTON_LEFT)};
}

ReplayBar Controls::bar() const {
  const Pointer p = pointer();
  return stage_->replay_bar(p.width, p.height);
}

void Controls::look_from(Camera::Side side) {
  view_.camera().look_from(side);
  view_.fit(frame());
}

void Controls::turn_or_move(int key, bool move) {
  constexpr float kStep = 0.04F;
  const float dx = key == GLFW_KEY_LEFT ? -kStep : key == GLFW_KEY_RIGHT ? kStep : 0;
  const float dy = key == GLFW_KEY_UP ? -kStep : key == GLFW_KEY_DOWN ? kStep : 0;
  move ? view_.camera().pan(dx, dy) : view_.camera().orbit(dx, dy);
}

void Controls::on_key(int key, int mods) {
  switch (key) {
    case GLFW_KEY_Q:
    case GLFW_KEY_ESCAPE:
      return glfwSetWindowShouldClose(window_, GLFW_TRUE);
    case GLFW_KEY_F:
      return view_.fit(frame());
    case GLFW_KEY_T:
      return look_from(Camera::Side::top);
    case GLFW_KEY_1:
      return look_from(Camera::Side::front);
    case GLFW_KEY_3:
      return look_from(Camera::Side::side);
    case GLFW_KEY_2:
      return look_from(Camera::Side::three_quarter);
    case GLFW_KEY_L:
      look_.dark = !look_.dark;
      return;
    case GLFW_KEY_W:
      look_.lines = next_of(look_.lines, 3);
      return;
    case GLFW_KEY_C:
      look_.color = next_of(look_.color, static_cast<int>(kShapeChannels));
      return view_.source().show_channel(look_.color);
    case GLFW_KEY_P:
      look_.panels = !look_.panels;
      return view_.camera().cover(frame().covered);
    case GLFW_KEY_N:
      look_.patch = touch_ != nullptr && !look_.patch;
      return;
    case GLFW_KEY_M:
      if (touch_ != nullptr) touch_->click();
      return;
    case GLFW_KEY_R:
      if (live_ != nullptr) live_->toggle_recording();
      return;
    case GLFW_KEY_X:
      if (live_ != nullptr) live_->core().ask_reset();
      return;
    case GLFW_KEY_EQUAL:
    case GLFW_KEY_KP_ADD:
      return view_.camera().zoom(1);
    case GLFW_KEY_MINUS:
    case GLFW_KEY_KP_SUBTRACT:
      return view_.camera().zoom(-1);
    case GLFW_KEY_LEFT:
    case GLFW_KEY_RIGHT:
    case GLFW_KEY_UP:
    case GLFW_KEY_DOWN:
      return turn_or_move(key, (mods & GLFW_MOD_SHIFT) != 0);
    default:
      if (replay_ != nullptr) on_replay_key(key);
  }
}

void Controls::on_replay_key(int key) {
  constexpr Micros kPage{5'000'000};
  const Micros now = now_us();
  ReplayClock& clock = replay_->clock();
  switch (key) {
    case GLFW_KEY_SPACE:
      return clock.toggle(now);
    case GLFW_KEY_COMMA:
      return replay_->step(-1, now);
    case GLFW_KEY_PERIOD:
      return replay_->step(1, now);
    case GLFW_KEY_LEFT_BRACKET:
      return clock.double_speed(-1, now);
    case GLFW_KEY_RIGHT_BRACKET:
      return clock.double_speed(1, now);
    case GLFW_KEY_PAGE_UP:
      return clock.seek(clock.at(now) - kPage, now);
    case GLFW_KEY_PAGE_DOWN:
      return clock.seek(clock.at(now) + kPage, now);
    case GLFW_KEY_HOME:
      return clock.seek(clock.begin(), now);
    case GLFW_KEY_END:
      return clock.seek(clock.end(), now);
    default:
      return;
  }
}

void Controls::on_button(bool pressed) {
  scrubbing_ = false;
  if (!pressed || replay_ == nullptr) return;
  const Micros now = now_us();
  const Pointer p = pointer();
  if (bar().on_button(p.x, p.y)) replay_->clock().toggle(now);
  scrubbing_ = bar().on_track(p.x, p.y);
  if (scrubbing_) replay_->clock().seek(bar().moment_at(replay_->state(now), p.x), now);
}

void Controls::on_move(double x, double y) {
  int width = 1, height = 1;
  glfwGetWindowSize(window_, &width, &height);
  const auto dx = static_cast<float>((x - last_x_) / std::max(1, height));
  const auto dy = static_cast<float>((y - last_y_) / std::max(1, height));
  last_x_ = x;
  last_y_ = y;
  if (scrubbing_) return replay_->clock().seek(bar().moment_at(replay_->state(now_us()), pointer().x), now_us());
  const bool shift = glfwGetKey(window_, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS;
  // Where the left button touches, the right one rotates and the middle one moves the view.
  const int turns = touch_ != nullptr ? GLFW_MOUSE_BUTTON_RIGHT : GLFW_MOUSE_BUTTON_LEFT;
  const bool moves =
      held(GLFW_MOUSE_BUTTON_MIDDLE) || (shift && held(turns)) || (touch_ == nullptr && held(GLFW_MOUSE_BUTTON_RIGHT));
  if (moves) {
    view_.camera().pan(dx, dy);
  } else if (held(turns)) {
    view_.camera().orbit(dx, dy);
  }
}

void Controls::on_scroll(float steps) {
  if (hand_ && held(GLFW_MOUSE_BUTTON_LEFT))
    hand_->deepen(steps);
  else
    view_.camera().zoom(steps);
}

void Controls::aim() {
  if (touch_ == nullptr) return;
  const ViewCore& core = live_->core();
  touch_->poll();
  if (!touch_->touching() || !core.ready()) return;
  if (!hand_ || hand_mesh_ != core.mesh_version()) {
    hand_.emplace(core.mesh().triangles, core.rest(), core.welcome().contact, core.welcome().home);
    hand_mesh_ = core.mesh_version();
  }
  const Micros now = now_us();
  touch_->aim(hand_->target(view_.camera(), pointer(), now - aimed_at_));
  aimed_at_ = now;
}

void Controls::mark_patch() {
  if (!look_.patch || touch_ == nullptr || !touch_->touching() || !live_->core().clock().locked())
    return view_.mark(nullptr, nullptr);
  const ViewCore& core = live_->core();
  const Foresight* foresight = touch_->foresight(core.clock().from_peer(view_.shown()));
  view_.mark(foresight, foresight != nullptr ? core.playback().frame_at(core.clock().to_peer(foresight->at)) : nullptr);
}

}  // namespace palpate
