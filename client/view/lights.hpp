// Camera, lights and their shadow maps' projections of one picture, and the studio that the body and the solids stand in.
#pragma once

#include "client/view/camera.hpp"
#include "client/view/gl_objects.hpp"
#include "client/view/sight.hpp"
#include "client/viewer/color.hpp"

namespace palpate {

struct Lights {
  Theme theme;
  Eigen::Matrix4f view_projection, key_matrix, sky_matrix;  ///< world to clip space: of the eye, the key light, straight down
  Vec3f eye, fill_direction, rim_direction;                 ///< position of the eye; directions of lights that move with it
  Vec3f floor_center;
  float size, floor_reach;  ///< diagonal of the body at rest, half the side of the floor [m]
  int taps;
  float line_pixels;  ///< width of a thin line

  bool operator==(const Lights& other) const = default;
};

/// `density`: pixels per point, which keeps line widths equal on any display.
Lights lights_of(const Box& rest, const Camera& camera, const Look& look, float aspect, float density);

/// Sets the uniforms of the vertex shaders and of the studio; the key light's shadow map is in texture unit 0.
void light(const GlProgram& program, const Lights& lights);

}  // namespace palpate
