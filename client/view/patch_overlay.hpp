// A patch's surface on the body: its triangles, and at each vertex the distance by which the patch missed the server's frame.
#pragma once

#include "client/view/camera.hpp"
#include "client/view/foresight.hpp"
#include "client/view/sight.hpp"

namespace palpate {

struct Pen;

/// Places the foresight's vertices on the body as `shown`, matched by their positions in `frame`, the shape of the foresight's
/// moment.
std::vector<PatchPin> pins_on(const Foresight& foresight, std::span<const Vec3f> frame, std::span<const Vec3f> shown);

/// Returns the magnification of the lines of misses: the end of the legend is a twentieth of the body.
float miss_magnification(const Sight& sight);
void draw_patch(const Pen& pen, const Sight& sight, const Camera& camera);

}  // namespace palpate
