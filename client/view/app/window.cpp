#include "client/view/app/window.hpp"

#include <epoxy/gl.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "client/view/app/scene_view.hpp"

namespace palpate {
namespace {

constexpr Micros kFramePeriod{16'667}, kSoftwareFramePeriod{50'000};
constexpr const char* kKeys =
    "drag: turn   right drag: move   wheel: zoom   F fit   T 1 3: top front side   L light   W mesh   Q quit";

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

Window open_window(const ViewOptions& options) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  Window window(glfwCreateWindow(options.width, options.height, "Palpate", nullptr, nullptr), &glfwDestroyWindow);
  if (!window) throw std::runtime_error(glfw_failure("no window with OpenGL 3.3"));
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  return window;
}

/// What mouse and keys act on. Reached from the window's callbacks through its user pointer.
struct Controls {
  ViewSession& session;
  SceneView view;
  Look look;
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

  static void on_key(GLFWwindow* window, int key, int, int action, int) {
    if (action != GLFW_PRESS) return;
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
        self.look.wireframe = !self.look.wireframe;
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
    if (held(GLFW_MOUSE_BUTTON_RIGHT) || held(GLFW_MOUSE_BUTTON_MIDDLE) || (shift && held(GLFW_MOUSE_BUTTON_LEFT))) {
      self.view.camera().pan(dx, dy);
    } else if (held(GLFW_MOUSE_BUTTON_LEFT)) {
      self.view.camera().orbit(dx, dy);
    }
  }

  static void on_scroll(GLFWwindow* window, double, double steps) { of(window).view.camera().zoom(static_cast<float>(steps)); }
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
  controls.view.update(controls.session, Controls::aspect(window));
  stage.draw(controls.view.sight(controls.session), controls.view.caption(controls.session, kKeys), controls.view.camera(),
             controls.look, width, height, 0);
  glfwSwapBuffers(window);
}

}  // namespace

void run_window(const ViewOptions& options, ViewSession& session) {
  const Glfw glfw;
  const Window window = open_window(options);
  const bool software = draws_in_software();
  Controls controls{.session = session, .view = {}, .look = options.look};
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
    draw(window.get(), controls, stage);
    session.pump_until(next);
  }
}

}  // namespace palpate
