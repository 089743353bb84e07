// Pictures without a display: one after a delay (--screenshot) or a sequence (--frames).
#pragma once

#include "client/view/app/options.hpp"
#include "client/view/app/recorded_source.hpp"
#include "client/view/app/session.hpp"

namespace palpate {

/// Runs until the pictures are written. Throws std::runtime_error when no shape arrived in time or OpenGL is missing.
void run_offscreen(const ViewOptions& options, ViewSession& session);
/// Does the same for a recording, at full speed: the same recording and flags make the same pictures.
void run_offscreen(const ViewOptions& options, RecordedSource& recording);

}  // namespace palpate
