// Rigid parts, instruments and force arrows on the graphics side; uploaded again only when one of them changed.
#pragma once

#include "client/view/gl_objects.hpp"
#include "client/view/sight.hpp"
#include "client/view/solids.hpp"

namespace palpate {

class SolidBatch {
 public:
  /// Needs a current OpenGL 3.3 core context, as do all functions below.
  SolidBatch();
  /// Shows these tools and parts from now on. Returns true when anything differs from before.
  bool show(const Sight& sight, const Box& rest);
  void draw() const;
  void draw_arrows() const;

  /// Radius of an instrument's ball tip and of its arrow, in proportion to the body [m].
  static float tip_radius(const Box& rest) { return 0.014F * rest.diagonal(); }

 private:
  GlVertexArray array_, parts_array_;
  GlBuffer buffer_, parts_buffer_;
  std::size_t parts_vertices_ = 0;
  std::uint64_t parts_version_ = 0;
  SolidMesh solids_, next_;
  std::size_t arrows_from_ = 0;  ///< index into solids_; the arrows end with it
};

}  // namespace palpate
