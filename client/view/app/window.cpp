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

#include "client/view/app/controls.hpp"
#include "client/view/app/draw_times.hpp"

namespace palpate {
namespace {

constexpr Micros kFramePeriod{16'667}, kSoftwareFramePeriod{50'000};
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

/// Describes what this machine has instead of OpenGL 3.3.
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
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);  // sizes are in points
  Window window = make_window(options);
  if (!window) {
    const std::string why = glfw_failure("no window with OpenGL 3.3 core");
    throw std::runtime_error(why + "; found " + found_opengl(options));
  }
  glfwMakeContextCurrent(window.get());
  glfwSwapInterval(1);
  return window;
}

bool draws_in_software() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string_view name = renderer != nullptr ? renderer : "";
  return name.find("llvmpipe") != std::string_view::npos || name.find("softpipe") != std::string_view::npos;
}

void draw(GLFWwindow* window, Controls& controls, Stage& stage, const TouchStation* touch) {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window, &width, &height);
  if (width == 0 || height == 0) return;
  const bool own = touch != nullptr && touch->touching();
  const Micros now = now_us();
  controls.view().update(now, controls.frame(), own ? &touch->tool() : nullptr);
  controls.mark_patch();
  Caption caption = controls.view().caption(now);
  caption.keys = controls.keys();
  if (touch != nullptr && !own) caption.status = "the mouse cannot touch yet  " + touch->refusal();
  if (own && touch->released())
    caption.status = "the server released the mouse's tool, because it cost the body more than a hand does";
  stage.draw(controls.view().sight(), caption, controls.view().camera(), controls.look(), width, height, 0);
  glfwSwapBuffers(window);
}

Look window_look(const ViewOptions& options, bool software, float density) {
  Look look = options.look;
  if (!software) return look;
  look.shadow_taps = 4;
  look.smooth_edges = false;
  look.pixel = static_cast<int>(density);
  look.triangle_budget = 8'000;
  return look;
}

/// The window of a program that draws until it is closed.
class Screen {
 public:
  explicit Screen(const ViewOptions& options)
      : options_(options),
        window_(open_window(options)),
        software_(draws_in_software()),
        density_(find_density()),
        stage_(make_stage()) {}
  Look look() const { return window_look(options_, software_, density_); }
  void run(Controls& controls, const TouchStation* touch);

 private:
  float find_density() const {
    float density = 1;
    glfwGetWindowContentScale(window_.get(), &density, nullptr);
    return std::max(1.0F, density);
  }
  Stage make_stage() const {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_.get(), &width, &height);
    return {std::max(1, width), std::max(1, height), density_};
  }

  const ViewOptions& options_;
  Glfw glfw_;
  Window window_;
  bool software_;
  float density_;
  Stage stage_;
};

void Screen::run(Controls& controls, const TouchStation* touch) {
  controls.attach(window_.get(), stage_, density_);
  ViewSource& source = controls.view().source();
  const Micros end = options_.duration_s ? now_us() + from_seconds(*options_.duration_s) : Micros::max();
  DrawTimes times;
  while (!glfwWindowShouldClose(window_.get()) && !stop_requested() && now_us() < end) {
    const Micros begun = now_us();
    glfwPollEvents();
    source.pump_until(begun);
    controls.aim();
    draw(window_.get(), controls, stage_, touch);
    times.add(begun, now_us());
    source.pump_until(begun + (software_ ? kSoftwareFramePeriod : kFramePeriod));
  }
  fmt::print("palpate-view: {}\n", times.summary(stage_.drawn()));
}

}  // namespace

void run_window(const ViewOptions& options, ViewSession& session) {
  Screen screen(options);
  std::optional<TouchStation> touch;
  if (!options.touch.empty())
    touch.emplace(options.server, options.touch, options.room, options.keys, options.guide, options.tool);
  Controls controls(session, touch ? &*touch : nullptr, screen.look(), options.camera);
  screen.run(controls, touch ? &*touch : nullptr);
  if (touch) fmt::print("palpate-view: {}\n", touch->summary());
}

void run_window(const ViewOptions& options, RecordedSource& recording) {
  Screen screen(options);
  Controls controls(recording, screen.look(), options.camera);
  recording.clock().toggle(now_us());
  screen.run(controls, nullptr);
}

}  // namespace palpate
