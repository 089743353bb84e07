#include "client/view/app/window.hpp"

#include <epoxy/gl.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "client/view/app/scene_view.hpp"
#include "client/view/app/touch.hpp"
#include "client/view/pointer_tool.hpp"

namespace palpate {
namespace {

constexpr Micros kFramePeriod{16'667}, kSoftwareFramePeriod{50'000};
constexpr const char* kKeys =
    "drag turn   right drag move   wheel zoom   F fit   T 1 3 2 sides   L light   W lines   C colours   P panels   Q quit";

constexpr const char* kTouchKeys =
    "left button touch   wheel deeper   right drag turn   middle drag move   F fit   L light   W lines   C colours   P panels   "
    "Q quit";

std::string glfw_failure(const std::string& what) {
  const char* why = nullptr;
  glfwGetError(&why);
  return what + (why != nullptr ? std::string(" (") + why + ")" : "") + "; --screenshot FILE.png works without a display";
}

struct Glfw {
  Glfw() {
    if (!glfwInit()) throw std::runtime_error(glfw_failure("no display"));
  }
  ~Glfw() { glfwTerminate(); }
};
using Window = std::unique_ptr<GLFWwindow, decltype(&glfwDestroyWindow)>;

Window make_window(const ViewOptions& options) {
  return {glfwCreateWindow(options.width, options.height, "Palpate", nullptr, nullptr), &glfwDestroyWindow};
}

/// What this machine has in place of OpenGL 3.3, in words.
std::string found_opengl(const ViewOptions& options) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  const Window any = make_window(options);
  if (!any) return "no OpenGL at all";
  glfwMakeContextCurrent(any.get());
  const auto text = [](GLenum name) {
    const auto* words = reinterpret_cast<const char*>(glGetString(name));
    return std::string(words != nullptr ? words : "unknown");
  };
  return "OpenGL " + text(GL_VERSION) + " of " + text(GL_RENDERER);
}

Window open_window(const ViewOptions& options) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  Window window = make_window(options);
  if (!window) {
    const std::string why = glfw_failure("no window with OpenGL 3.3 core");
    throw std::runtime_error(why + "; found " + found_opengl(options));
  }
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  return window;
}

template <class Choice>
Choice next_of(Choice choice, int count) {
  return static_cast<Choice>((static_cast<int>(choice) + 1) % count);
}

/// What mouse and keys act on. Reached from the window's callbacks through its user pointer.
struct Controls {
  ViewSession& session;
  TouchStation* touch;  ///< nullptr: look only
  SceneView view;
  Look look;
  std::optional<PointerTool> pointer;
  std::uint64_t pointer_mesh = 0;  ///< version of the mesh that it knows
  double last_x = 0, last_y = 0;

  static Controls& of(GLFWwindow* window) { return *static_cast<Controls*>(glfwGetWindowUserPointer(window)); }

  static float aspect(GLFWwindow* window) {
    int width = 1, height = 1;
    glfwGetFramebufferSize(window, &width, &height);
    return static_cast<float>(std::max(1, width)) / static_cast<float>(std::max(1, height));
  }

  void look_from(GLFWwindow* window, Camera::Side side) {
    view.camera().look_from(side);
    view.fit(session, aspect(window));
  }

  void turn_or_move(int key, bool move) {
    constexpr float kStep = 0.04F;
    const float dx = key == GLFW_KEY_LEFT ? -kStep : key == GLFW_KEY_RIGHT ? kStep : 0;
    const float dy = key == GLFW_KEY_UP ? -kStep : key == GLFW_KEY_DOWN ? kStep : 0;
    move ? view.camera().pan(dx, dy) : view.camera().orbit(dx, dy);
  }

  static void on_key(GLFWwindow* window, int key, int, int action, int mods) {
    if (action == GLFW_RELEASE) return;
    Controls& self = of(window);
    switch (key) {
      case GLFW_KEY_Q:
      case GLFW_KEY_ESCAPE:
        glfwSetWindowShouldClose(window, GLFW_TRUE);
        break;
      case GLFW_KEY_F:
        self.view.fit(self.session, aspect(window));
        break;
      case GLFW_KEY_T:
        self.look_from(window, Camera::Side::top);
        break;
      case GLFW_KEY_1:
        self.look_from(window, Camera::Side::front);
        break;
      case GLFW_KEY_3:
        self.look_from(window, Camera::Side::side);
        break;
      case GLFW_KEY_2:
        self.look_from(window, Camera::Side::three_quarter);
        break;
      case GLFW_KEY_L:
        self.look.dark = !self.look.dark;
        break;
      case GLFW_KEY_W:
        self.look.lines = next_of(self.look.lines, 3);
        break;
      case GLFW_KEY_C:
        self.look.color = next_of(self.look.color, static_cast<int>(kShapeChannels));
        self.session.core().show_channel(self.look.color);
        break;
      case GLFW_KEY_P:
        self.look.panels = !self.look.panels;
        break;
      case GLFW_KEY_EQUAL:
      case GLFW_KEY_KP_ADD:
        self.view.camera().zoom(1);
        break;
      case GLFW_KEY_MINUS:
      case GLFW_KEY_KP_SUBTRACT:
        self.view.camera().zoom(-1);
        break;
      case GLFW_KEY_LEFT:
      case GLFW_KEY_RIGHT:
      case GLFW_KEY_UP:
      case GLFW_KEY_DOWN:
        self.turn_or_move(key, (mods & GLFW_MOD_SHIFT) != 0);
        break;
      default:
        break;
    }
  }

  static void on_move(GLFWwindow* window, double x, double y) {
    Controls& self = of(window);
    int width = 1, height = 1;
    glfwGetWindowSize(window, &width, &height);
    const auto dx = static_cast<float>((x - self.last_x) / std::max(1, height));
    const auto dy = static_cast<float>((y - self.last_y) / std::max(1, height));
    self.last_x = x;
    self.last_y = y;
    const auto held = [window](int button) { return glfwGetMouseButton(window, button) == GLFW_PRESS; };
    const bool shift = glfwGetKey(window, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS;
    // While the left button touches, the right one turns and the middle one moves.
    const int turns = self.touch != nullptr ? GLFW_MOUSE_BUTTON_RIGHT : GLFW_MOUSE_BUTTON_LEFT;
    const bool moves =
        held(GLFW_MOUSE_BUTTON_MIDDLE) || (shift && held(turns)) || (self.touch == nullptr && held(GLFW_MOUSE_BUTTON_RIGHT));
    if (moves) {
      self.view.camera().pan(dx, dy);
    } else if (held(turns)) {
      self.view.camera().orbit(dx, dy);
    }
  }

  static void on_scroll(GLFWwindow* window, double, double steps) {
    Controls& self = of(window);
    const bool pressing = self.pointer && glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
    if (pressing)
      self.pointer->deepen(static_cast<float>(steps));
    else
      self.view.camera().zoom(static_cast<float>(steps));
  }

  /// Tells the mouse's station where the pointer is.
  void aim(GLFWwindow* window) {
    ViewCore& core = session.core();
    touch->poll();
    if (!touch->touching() || !core.ready()) return;
    if (!pointer || pointer_mesh != core.mesh_version()) {
      pointer.emplace(core.mesh().triangles, core.rest(), core.welcome().contact, core.welcome().home);
      pointer_mesh = core.mesh_version();
    }
    int width = 1, height = 1;
    glfwGetWindowSize(window, &width, &height);
    const bool held = glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
    touch->aim(
        pointer->target(view.camera(), {static_cast<float>(last_x), static_cast<float>(last_y),
                                        static_cast<float>(std::max(1, width)), static_cast<float>(std::max(1, height)), held}));
  }
};

bool draws_in_software() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string_view name = renderer != nullptr ? renderer : "";
  return name.find("llvmpipe") != std::string_view::npos || name.find("softpipe") != std::string_view::npos;
}

void draw(GLFWwindow* window, Controls& controls, Stage& stage) {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  if (width == 0 || height == 0) return;
  const bool own = controls.touch != nullptr && controls.touch->touching();
  controls.view.update(controls.session, Controls::aspect(window), own ? &controls.touch->tool() : nullptr);
  Caption caption = controls.view.caption(controls.session, controls.touch != nullptr ? kTouchKeys : kKeys);
  if (controls.touch != nullptr && !own) caption.status = "the mouse cannot touch yet  " + controls.touch->refusal();
  stage.draw(controls.view.sight(controls.session), caption, controls.view.camera(), controls.look, width, height, 0);
  glfwSwapBuffers(window);
}

}  // namespace

void run_window(const ViewOptions& options, ViewSession& session) {
  const Glfw glfw;
  const Window window = open_window(options);
  const bool software = draws_in_software();
  std::optional<TouchStation> touch;
  if (!options.touch.empty()) touch.emplace(options.server, options.touch, options.room);
  Controls controls{.session = session, .touch = touch ? &*touch : nullptr, .view = {}, .look = options.look, .pointer = {}};
  if (software) {
    controls.look.shadow_taps = 4;
    controls.look.triangle_budget = 8'000;
  }
  glfwSetWindowUserPointer(window.get(), &controls);
  glfwSetKeyCallback(window.get(), &Controls::on_key);
  glfwSetCursorPosCallback(window.get(), &Controls::on_move);
  glfwSetScrollCallback(window.get(), &Controls::on_scroll);
  float density = 1;
  glfwGetWindowContentScale(window.get(), &density, nullptr);
  int width = 0, height = 0;
  glfwGetFramebufferSize(window.get(), &width, &height);
  Stage stage(std::max(1, width), std::max(1, height), std::max(1.0F, density));

  const Micros end = options.duration_s ? now_us() + from_seconds(*options.duration_s) : Micros::max();
  while (!glfwWindowShouldClose(window.get()) && !told_to_end() && now_us() < end) {
    const Micros next = now_us() + (software ? kSoftwareFramePeriod : kFramePeriod);
    glfwPollEvents();
    session.pump();
    if (touch) controls.aim(window.get());
    draw(window.get(), controls, stage);
    session.pump_until(next);
  }
  if (touch) fmt::print("palpate-view: {}\n", touch->summary());
}

}  // namespace palpate
