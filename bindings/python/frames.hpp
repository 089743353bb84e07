// Frames, tools and patches of a room as Python holds them: a tool and a patch keep their frame, so that views into it stay
// valid.
#pragma once

#include <memory>

#include "server/room/room.hpp"

namespace palpate::python {

using Frame = std::shared_ptr<FrameResult>;  ///< never changed after the step

struct FrameTool {
  Frame frame;
  const StationFrame* tool = nullptr;
  const StationFrame& operator*() const { return *tool; }
  const StationFrame* operator->() const { return tool; }
};

/// Has a patch.
struct FramePatch : FrameTool {
  const Patch& patch() const { return *tool->patch; }
};

}  // namespace palpate::python
