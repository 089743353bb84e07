// The visible state of one moment, and the settings of its display.
#pragma once

#include <cstdint>
#include <span>

#include "client/viewer/surface.hpp"
#include "common/wire/messages.hpp"

namespace palpate {

/// A vertex of a patch's surface on the body.
struct PatchPin {
  Vec3f at;               ///< on the body as it is drawn
  Vec3f miss;             ///< displacement from the server's frame to the patch's prediction [m]
  bool compared = false;  ///< true: the miss is known
};

/// The visible state. Displacement is measured from `rest`; the spans over vertices have the same size.
struct Sight {
  std::span<const Triangle> triangles;
  std::span<const Vec3f> positions, rest;
  std::span<const float> scalars;        ///< values that replace displacement as colours; empty: displacement
  std::span<const MeshVertex> vertices;  ///< vertices, of which the fixed ones are marked; empty: none
  std::span<const ToolView> tools;
  std::span<const ToolShape> shapes = {};  ///< body of each tool, empty of a point; empty: all are points
  std::span<const float> depths = {};      ///< depth of each tool below the surface at rest [m]; empty, or 0 outside: not shown
  std::span<const std::size_t> hues = {};  ///< index of each tool's station_color(); empty: that of its place
  std::span<const PatchPin> pins = {};     ///< vertices of the displayed patch; empty: none
  std::span<const Triangle> pin_triangles = {};
  std::span<const BodyName> bodies = {};        ///< of a scene with several; empty: one
  std::span<const PartMesh> parts = {};         ///< rigid parts of the scene
  std::uint64_t parts_version = 0;              ///< changes with them
  ShapeChannel color = ShapeChannel::position;  ///< quantity of the scalars
  bool closed = false;                          ///< is_closed(triangles): back faces need no drawing
  float color_max = 0.002F;                     ///< end of the colour legend, [m] or the unit of the scalars
  float arrow_m_per_n = 0.02F;                  ///< length of force arrows
  float miss_max_m = 1e-4F;                     ///< end of the legend of misses

  float depth(std::size_t tool) const { return tool < depths.size() ? depths[tool] : 0; }
  std::size_t hue(std::size_t tool) const { return tool < hues.size() ? hues[tool] : tool; }
};

/// Lines over the body: none, the edges of its triangles, or the edges in the colour of their strain.
enum class Lines : std::uint8_t { none, edges, strain };
inline constexpr float kStrainMax = 0.06F;  ///< strain at which the colour saturates

struct Look {
  bool dark = false, panels = true;
  bool patch = false;  ///< true: shows the prediction of the viewer's own patch next to the server's frame
  Lines lines = Lines::none;
  ShapeChannel color = ShapeChannel::position;  ///< requested quantity; until it arrives, a sight has another
  bool smooth_edges = true;                     ///< multisampling
  int pixel = 1;                                ///< pixel size of pictures without smoothing, in pixels of the target
  int shadow_taps = 16;                         ///< samples of a penumbra on the body; the floor uses 2.5 times as many
  int triangle_budget = 20'000;                 ///< limit of refined triangles of the body; beyond it the refinement is coarser
};

}  // namespace palpate
