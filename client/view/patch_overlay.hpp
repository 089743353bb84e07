// A patch's surface on the body: its triangles, and at each vertex how far the patch missed the server's frame.
#pragma once

#include "client/view/camera.hpp"
#include "client/view/foresight.hpp"
#include "client/view/sight.hpp"

namespace palpate {

struct Pen;

/// The foresight's vertices on the body as `shown`, told by where `frame`, the shape of the foresight's moment, has them.
std::vector<PatchPin> pins_on(const Foresight& foresight, std::span<const Vec3f> frame, std::span<const Vec3f> shown);

/// Lines of misses are so many times as long as the misses: the legend's end is a twentieth of the body.
float miss_magnification(const Sight& sight);
void draw_patch(const Pen& pen, const Sight& sight, const Camera& camera);

}  // namespace palpate
