// Draws one moment of the body and its instruments into a framebuffer, OpenGL 3.3 core.
//
// Passes: shadow maps (key light and straight down) -> the floor's shadow, blurred -> body -> solids -> background -> floor with
// a ruler grid, the last four with 4x multisampling unless disabled by the look, then resolved into the target. A pass whose
// inputs equal those of the previous picture is skipped: shadows of a body at rest, and everything but the last step when the
// camera rests too.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "client/view/body_batch.hpp"
#include "client/view/ground.hpp"
#include "client/view/solid_batch.hpp"

namespace palpate {

class Renderer {
 public:
  /// Needs a current OpenGL 3.3 core context. Throws std::runtime_error when the driver refuses a shader or a target. `density`:
  /// pixels per point, which keeps line widths equal on any display.
  explicit Renderer(float density);
  void draw(const Sight& sight, const Camera& camera, const Look& look, int width, int height, GlId target);
  /// Number of pictures that were more than a copy of the one before.
  int drawn() const { return drawn_; }

 private:
  /// Inputs of a picture apart from body and solids.
  struct Shown {
    Lights lights;
    std::vector<Vec3f> bodies;  ///< linear colours of several; empty: one
    float color_max;
    Lines lines;
    bool smooth_edges;
    int width, height, pixel;

    bool operator==(const Shown& other) const = default;
  };
  void draw_shadow(const GlTarget& map, const Eigen::Matrix4f& matrix) const;
  void draw_body(const Shown& shown);
  void draw_hidden_arrows(const Lights& lights) const;
  void draw_solids(const Lights& lights) const;
  void bind_samples(const Shown& shown);
  void resolve(int width, int height, GlId target) const;

  std::array<std::optional<GlProgram>, 6> body_;  ///< plain, then curved; each for every kind of lines, created when first drawn
  GlProgram solid_, plain_depth_, curved_depth_, solid_depth_;
  BodyBatch body_batch_;
  SolidBatch solid_batch_;
  Ground ground_;
  GlTexture colors_;
  GlTarget key_map_, sky_map_;
  std::unique_ptr<GlTarget> samples_;
  std::optional<Shown> shown_;
  float density_;
  int drawn_ = 0;
};

}  // namespace palpate
