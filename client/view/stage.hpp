// Renderer and overlay together: they turn a moment of the body into a framebuffer or a picture.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "client/view/overlay.hpp"
#include "client/view/png.hpp"
#include "client/view/renderer.hpp"

namespace palpate {

/// Scales for legible legends: rounded, and never shrinking while one watches.
class Scales {
 public:
  /// Extends the scales to a moment. Without scalars the colours are those of displacement; each channel has a legend of its own.
  void see(std::span<const Triangle> triangles, std::span<const Vec3f> positions, std::span<const Vec3f> rest,
           std::span<const ToolView> tools, ShapeChannel channel = ShapeChannel::position, std::span<const float> scalars = {});
  /// Extends them to known maxima: the largest motion of a vertex, the largest force.
  void expect(float displacement_m, float force_n);
  void see_misses(std::span<const PatchPin> pins);
  /// End of the legend: [m] of displacement, or in the unit of the scalars.
  float color_max(ShapeChannel channel) const { return color_max_[static_cast<std::size_t>(channel)]; }
  float arrow_m_per_n() const { return arrow_m_per_n_; }
  float miss_max_m() const { return miss_max_m_; }

 private:
  std::array<float, kShapeChannels> color_max_{0.001F, 0.01F, 0.01F, 100, 0.01F, 100};
  float arrow_m_per_n_ = 0.001F, force_peak_n_ = 0.5F, miss_max_m_ = 1e-5F;
};

/// Share of a picture's width that its panels cover.
float covered_by_panels(const Look& look, int width, int height, float density);

class Stage {
 public:
  /// Needs a current OpenGL 3.3 core context that outlives it. `density` is the display's pixels per point, 1 offscreen.
  Stage(int width, int height, float density);
  /// Draws into a framebuffer of this size.
  void draw(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width, int height,
            GlId target);
  /// Returns the same as a picture, through a framebuffer of its own.
  Picture photograph(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width, int height);

  /// Number of pictures of the body that were more than a copy of the one before.
  int drawn() const { return renderer_.drawn(); }

  /// Returns the layout of the replay bar in a picture of this size.
  ReplayBar replay_bar(float width, float height) const { return {width, height, overlay_.scale()}; }

 private:
  Renderer renderer_;
  Overlay overlay_;
  std::optional<GlTarget> picture_;
};

}  // namespace palpate
