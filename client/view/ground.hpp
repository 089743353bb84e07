// The surroundings of the body: a floor with a ruler grid and the body's blurred shadow, and the background.
#pragma once

#include "client/view/lights.hpp"

namespace palpate {

class Ground {
 public:
  /// Needs a current OpenGL 3.3 core context, as do all functions below.
  Ground();
  /// Computes the floor's shadow from the shadow maps of the key light and of straight down.
  void cast(const GlTarget& key_map, const GlTarget& sky_map, const Lights& lights);
  /// Draws only where nothing has been drawn yet: covered parts cost no shading.
  void draw(const Lights& lights) const;

  /// Spacing of the grid for a body of this size: 1, 2 or 5 times a power of ten [m].
  static float grid_spacing(float size);

 private:
  void draw_background(const Lights& lights) const;
  void draw_floor(const Lights& lights) const;

  GlProgram shadow_, floor_, background_;
  GlVertexArray corners_;               ///< four corners, placed by the shaders
  GlTarget wide_key_map_, shadow_map_;  ///< the wide map is coarse, for soft shadows
};

}  // namespace palpate
