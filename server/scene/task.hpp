// The training task of a scene: fits what the file states to the body (common/task/task.hpp has the meaning).
//
// The line of `trace` is cut into steps of kLineStepM (longer where there would be more than kMaxLinePoints), and every point is
// put onto the nearest point of the surface at rest.
#pragma once

#include <optional>

#include "server/scene/scene_text.hpp"
#include "server/scene/settings.hpp"

namespace palpate {

inline constexpr double kLineStepM = 0.005;        ///< of a line between the points of the scene
inline constexpr double kOffSurfaceMostM = 0.005;  ///< farthest from the surface that a point of a line may be stated
inline constexpr std::size_t kMostStatedPoints = 24;

/// Reads `task`; `lump` is that of the body. Throws InputError.
std::optional<TaskSettings> read_task_settings(const SceneText& text, const std::optional<LumpSettings>& lump);
std::optional<LumpSettings> read_lump(const SceneText& text, bool planar);

/// Throws InputError for a line that is off the surface, or leaves it between two points.
Task fit_task(const LumpedBody& body, const SceneSettings& settings, const SceneText& text);

}  // namespace palpate
