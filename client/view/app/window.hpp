// A view source in a window, with mouse and keys.
#pragma once

#include "client/view/app/options.hpp"
#include "client/view/app/recorded_source.hpp"
#include "client/view/app/session.hpp"

namespace palpate {

/// Runs until the window is closed, --duration-s has passed or the process is asked to end. Throws std::runtime_error when there
/// is no display or no OpenGL 3.3.
void run_window(const ViewOptions& options, ViewSession& session);
/// Plays the recording from its beginning or --at.
void run_window(const ViewOptions& options, RecordedSource& recording);

}  // namespace palpate
