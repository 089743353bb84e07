// An OpenGL 3.3 core context without a window, a display or X: surfaceless EGL.
#pragma once

#include <memory>

namespace palpate {

class OffscreenContext {
 public:
  /// Creates the context and makes it current on this thread. Software rendering is limited to one thread, so that a picture does
  /// not take the processor from a haptic loop on the same machine. Throws std::runtime_error naming the step that failed.
  OffscreenContext();
  ~OffscreenContext();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
