// The training task over the picture: its goal, a bar of the progress of each hand, the band of the force for `press`, the line
// on the body for `trace`, and for `find` the lump, once a hand has marked it.
#pragma once

#include "client/view/camera.hpp"
#include "client/view/pen.hpp"
#include "client/view/sight.hpp"
#include "client/viewer/task_watch.hpp"

namespace palpate {

/// Draws the box with its upper left corner at (x, y).
void draw_task(const Pen& pen, const Sight& sight, const TaskWatch& watch, float x, float y);
/// Draws line, marks and lump on the body at rest.
void draw_task_target(const Pen& pen, const TaskWatch& watch, const Camera& camera);

}  // namespace palpate
