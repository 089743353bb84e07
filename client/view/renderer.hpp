// Draws one moment of the body and its instruments into a framebuffer, OpenGL 3.3 core.
//
// Passes: shadow maps (key light and straight down) -> the floor's shadow, blurred -> background -> floor with a ruler grid
// -> body -> solids, the last four with 4x multisampling unless the look says otherwise, then resolved into the target. Body
// triangles are refined on the graphics side into curved point-normal triangles that pass through the received vertices, so
// contact stays where it is; where there are too many for that they are drawn as they are.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/view/camera.hpp"
#include "client/view/color.hpp"
#include "client/view/gl_objects.hpp"
#include "client/view/solids.hpp"
#include "client/view/surface.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// A vertex of a patch's surface on the body.
struct PatchPin {
  Vec3f at;               ///< on the body as it is drawn
  Vec3f miss;             ///< from where the server's frame had it to where the patch said [m]
  bool compared = false;  ///< the miss is known
};

/// What is to be seen. `rest` is what displacement is measured from; the spans over vertices have the same size.
struct Sight {
  std::span<const Triangle> triangles;
  std::span<const Vec3f> positions, rest;
  std::span<const float> shade;          ///< what colours show in its place; empty: displacement
  std::span<const MeshVertex> vertices;  ///< whose fixed ones are marked; empty: none
  std::span<const ToolView> tools;
  std::span<const PatchPin> pins = {};  ///< of the patch that is shown; empty: none
  std::span<const Triangle> pin_triangles = {};
  bool closed = false;          ///< is_closed(triangles): back faces need no drawing
  float color_max = 0.002F;     ///< end of the colour legend, [m] or the unit of the shade
  float arrow_m_per_n = 0.02F;  ///< length of force arrows
  float miss_max_m = 1e-4F;     ///< end of the legend of misses
};

/// Lines over the body: none, the edges of its triangles, or these in the colour of their strain.
enum class Lines : std::uint8_t { none, edges, strain };
inline constexpr float kStrainMax = 0.06F;  ///< at which their colour is full

struct Look {
  bool dark = false, panels = true;
  bool patch = false;  ///< what the patch of the viewer's own hand said, beside the server's frame
  Lines lines = Lines::none;
  ShapeChannel color = ShapeChannel::position;  ///< what the legend names
  bool smooth_edges = true;                     ///< multisampling
  int pixel = 1;                                ///< of unsmoothed pictures of the body, in pixels of the target
  int shadow_taps = 16;                         ///< samples of a penumbra on the body; the floor takes 2.5 times as many
  int triangle_budget = 20'000;                 ///< refined triangles of the body; a coarser refinement when it would take more
};

class Renderer {
 public:
  /// Needs a current OpenGL 3.3 core context. Throws std::runtime_error when the driver refuses a shader or a target. `density`:
  /// pixels of a point, by which lines are as wide on any display.
  explicit Renderer(float density);
  void draw(const Sight& sight, const Camera& camera, const Look& look, int width, int height, GlId target);

  /// Spacing of the floor's grid for a body of this size: 1, 2 or 5 times a power of ten [m].
  static float grid_spacing(const Box& box);
  /// Radius of an instrument's ball tip and of its arrow, in proportion to the body [m].
  static float tip_radius(const Box& rest) { return 0.014F * rest.diagonal(); }

 private:
  struct Lights;
  /// What vertex `corner` of a triangle brings along; three are a triangle.
  struct Corner {
    Vec3f position, normal, look, strain;  ///< look: shade, cavity, fixed; strain: of the edge across from each corner
  };
  void refine(const Look& look);
  void upload_body(const Sight& sight, const Look& look);
  void upload_solids(const Sight& sight, const Box& rest);
  bool plain() const { return level_ == 1; }
  void draw_shadow(const GlTarget& map, const Eigen::Matrix4f& matrix, bool closed);
  void draw_floor_shadow(const Lights& lights);
  void draw_background(const Lights& lights) const;
  void draw_floor(const Lights& lights) const;
  void draw_body(const Sight& sight, const Lights& lights, const Look& look, float size);
  void draw_triangles() const;
  void draw_solids() const;
  void bind_samples(const Look& look, int width, int height);
  void light(const GlProgram& program, const Lights& lights) const;

  std::array<std::optional<GlProgram>, 6> body_;  ///< plain, then curved; each for every kind of lines, made when first drawn
  GlProgram solid_, floor_shadow_, floor_, background_, plain_depth_, curved_depth_, solid_depth_;
  GlVertexArray plain_array_, curved_array_, solid_array_, empty_array_;
  GlBuffer pattern_buffer_, corner_buffer_, solid_buffer_;
  GlTexture colors_;
  GlTarget key_map_, wide_key_map_, sky_map_, floor_map_;  ///< the wide map is coarse, for soft shadows on the floor
  std::unique_ptr<GlTarget> samples_;
  SurfaceShade surface_;
  SolidMesh solids_;
  std::vector<Corner> corners_;
  float density_;
  int level_ = 0, pattern_vertices_ = 0, triangles_ = 0;
};

/// A power of ten times 1, 2 or 5, the smallest that is not below x > 0.
float round_up_125(float x);
/// The largest that is not above x > 0.
float round_down_125(float x);

}  // namespace palpate
