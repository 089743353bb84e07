// Colours of the picture. sRGB values in [0, 1] unless a name says linear.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "client/viewer/surface.hpp"

namespace palpate {

Vec3f to_linear(const Vec3f& srgb);
Vec3f to_srgb(const Vec3f& linear);
/// Returns the colour 0xrrggbb.
Vec3f srgb_of(std::uint32_t rrggbb);

/// Colour of a displacement, s in [0, 1] of the legend: from the tissue's own dusky red to pale yellow, interpolated in OKLab
/// with lightness growing evenly, so that equal steps of millimetres look equal, also printed in grey and to colour-blind eyes.
Vec3f displacement_color(float s);

/// Linear colours of an edge in compression, slack or in tension.
struct StrainColors {
  Vec3f pushed, slack, pulled;
};
const StrainColors& strain_colors();
/// Colour of a strain, s in [-1, 1] of the legend, as the body's shader mixes it.
Vec3f strain_color(float s);

/// Colour of a patch's miss, s in [0, 1] of the legend: from white to a blue that no displacement has.
Vec3f miss_color(float s);

inline constexpr std::size_t kStationColors = 8;
/// Colour of a station's collar, arrow and label, by its place in the list. Colour-blind eyes can also distinguish them, from
/// each other and from steel and body.
Vec3f station_color(std::size_t index);

/// Linear colour of fixed parts.
Vec3f held_color();
/// Linear colour of threads.
Vec3f thread_color();
/// Linear colour of the walls of cuts.
Vec3f wall_color();

/// Everything in which light and dark pictures differ. The colours of lights are linear, the others sRGB.
struct Theme {
  Vec3f background_top, background_bottom;
  Vec3f key, fill, rim, sky, floor;  ///< linear
  Vec3f ink, ink_soft, accent;       ///< text, secondary text, highlights
  Vec3f grid;
  float grid_strength, shadow_strength;

  bool operator==(const Theme& other) const = default;
};
const Theme& theme(bool dark);

}  // namespace palpate
