// What is to be seen at one moment, and how one wants to look at it.
#pragma once

#include <cstdint>
#include <span>

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
  std::span<const float> scalars;        ///< what colours show in its place; empty: displacement
  std::span<const MeshVertex> vertices;  ///< whose fixed ones are marked; empty: none
  std::span<const ToolView> tools;
  std::span<const float> depths = {};      ///< of each tool below the surface at rest [m]; empty, or 0 outside: not shown
  std::span<const std::size_t> hues = {};  ///< which station_color() each tool has; empty: that of its place
  std::span<const PatchPin> pins = {};     ///< of the patch that is shown; empty: none
  std::span<const Triangle> pin_triangles = {};
  ShapeChannel color = ShapeChannel::position;  ///< what the scalars are of
  bool closed = false;                          ///< is_closed(triangles): back faces need no drawing
  float color_max = 0.002F;                     ///< end of the colour legend, [m] or the unit of the scalars
  float arrow_m_per_n = 0.02F;                  ///< length of force arrows
  float miss_max_m = 1e-4F;                     ///< end of the legend of misses

  float depth(std::size_t tool) const { return tool < depths.size() ? depths[tool] : 0; }
  std::size_t hue(std::size_t tool) const { return tool < hues.size() ? hues[tool] : tool; }
};

/// Lines over the body: none, the edges of its triangles, or these in the colour of their strain.
enum class Lines : std::uint8_t { none, edges, strain };
inline constexpr float kStrainMax = 0.06F;  ///< at which their colour is full

struct Look {
  bool dark = false, panels = true;
  bool patch = false;  ///< what the patch of the viewer's own hand said, beside the server's frame
  Lines lines = Lines::none;
  ShapeChannel color = ShapeChannel::position;  ///< what is asked for; until it is there, a sight has another
  bool smooth_edges = true;                     ///< multisampling
  int pixel = 1;                                ///< of unsmoothed pictures of the body, in pixels of the target
  int shadow_taps = 16;                         ///< samples of a penumbra on the body; the floor takes 2.5 times as many
  int triangle_budget = 20'000;                 ///< refined triangles of the body; a coarser refinement when it would take more
};

}  // namespace palpate
