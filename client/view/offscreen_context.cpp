#include "client/view/offscreen_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace palpate {

struct OffscreenContext::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  ~State() {
    if (display == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    eglTerminate(display);
  }
};

namespace {

[[noreturn]] void fail(const std::string& step) {
  std::array<char, 16> code{};
  std::snprintf(code.data(), code.size(), "0x%04x", static_cast<unsigned>(eglGetError()));
  throw std::runtime_error("no offscreen OpenGL: " + step + " failed (EGL error " + code.data() + ")");
}

/// Describes what this machine has instead of OpenGL 3.3.
std::string found_opengl(EGLDisplay display, EGLConfig config) {
  const std::array<EGLint, 1> any{EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, any.data());
  if (context == EGL_NO_CONTEXT || !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) return "no OpenGL at all";
  const auto text = [](GLenum name) {
    const auto* words = reinterpret_cast<const char*>(glGetString(name));
    return std::string(words != nullptr ? words : "unknown");
  };
  std::string found = "OpenGL " + text(GL_VERSION) + " of " + text(GL_RENDERER);
  eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display, context);
  return found;
}

}  // namespace

OffscreenContext::OffscreenContext() : state_(std::make_unique<State>()) {
  setenv("LP_NUM_THREADS", "1", 0);
  if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) fail("finding EGL_MESA_platform_surfaceless");
  state_->display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  if (state_->display == EGL_NO_DISPLAY) fail("eglGetPlatformDisplay");
  if (!eglInitialize(state_->display, nullptr, nullptr)) fail("eglInitialize");
  if (!eglBindAPI(EGL_OPENGL_API)) fail("eglBindAPI(OpenGL)");
  const std::array<EGLint, 3> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint found = 0;
  if (!eglChooseConfig(state_->display, wanted.data(), &config, 1, &found)) fail("eglChooseConfig");
  const std::array<EGLint, 7> core33{
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  state_->context = eglCreateContext(state_->display, found > 0 ? config : EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, core33.data());
  if (state_->context == EGL_NO_CONTEXT)
    throw std::runtime_error("no offscreen OpenGL 3.3 core; found " +
                             found_opengl(state_->display, found > 0 ? config : EGL_NO_CONFIG_KHR));
  if (!eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context)) fail("eglMakeCurrent");
}

OffscreenContext::~OffscreenContext() = default;

}  // namespace palpate
