#include "client/viewer/color.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

float linear_channel(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }
float srgb_channel(float c) {
  c = std::clamp(c, 0.0F, 1.0F);
  return c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1 / 2.4F) - 0.055F;
}

// OKLab to linear sRGB: B. Ottosson, "A perceptual color space for image processing", 2020.
Vec3f oklab_to_linear(const Vec3f& lab) {
  const float l = lab.x() + 0.3963377774F * lab.y() + 0.2158037573F * lab.z();
  const float m = lab.x() - 0.1055613458F * lab.y() - 0.0638541728F * lab.z();
  const float s = lab.x() - 0.0894841775F * lab.y() - 1.2914855480F * lab.z();
  const float l3 = l * l * l, m3 = m * m * m, s3 = s * s * s;
  return {4.0767416621F * l3 - 3.3077115913F * m3 + 0.2309699292F * s3,
          -1.2684380046F * l3 + 2.6097574011F * m3 - 0.3413193965F * s3,
          -0.0041960863F * l3 - 0.7034186147F * m3 + 1.7076147010F * s3};
}

// Lightness, chroma, hue [degrees]; lightness is linear in the position along the map.
constexpr std::array<std::array<float, 3>, 5> kStops{
    {{0.45F, 0.105F, 18.0F}, {0.57F, 0.145F, 29.0F}, {0.69F, 0.150F, 50.0F}, {0.81F, 0.140F, 78.0F}, {0.93F, 0.095F, 100.0F}}};

}  // namespace

Vec3f to_linear(const Vec3f& srgb) { return srgb.unaryExpr(&linear_channel); }
Vec3f to_srgb(const Vec3f& linear) { return linear.unaryExpr(&srgb_channel); }

Vec3f srgb_of(std::uint32_t rrggbb) {
  const auto of = [&](unsigned shift) { return static_cast<float>(rrggbb >> shift & 0xff) / 255; };
  return {of(16), of(8), of(0)};
}

Vec3f displacement_color(float s) {
  constexpr float kDegree = 0.01745329252F;
  const float at = std::clamp(s, 0.0F, 1.0F) * static_cast<float>(kStops.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const float f = at - static_cast<float>(i);
  std::array<float, 3> lch{};
  for (std::size_t k = 0; k < 3; ++k) lch[k] = (1 - f) * kStops[i][k] + f * kStops[i + 1][k];
  return to_srgb(oklab_to_linear({lch[0], lch[1] * std::cos(lch[2] * kDegree), lch[1] * std::sin(lch[2] * kDegree)}));
}

const StrainColors& strain_colors() {
  static const StrainColors kColors{Vec3f(0.05F, 0.28F, 0.85F), Vec3f(0.60F, 0.59F, 0.57F), Vec3f(0.90F, 0.16F, 0.04F)};
  return kColors;
}

Vec3f strain_color(float s) {
  const StrainColors& colors = strain_colors();
  const Vec3f& end = s < 0 ? colors.pushed : colors.pulled;
  return to_srgb(colors.slack + std::sqrt(std::abs(s)) * (end - colors.slack));
}

Vec3f miss_color(float s) {
  const Vec3f none(0.95F, 0.97F, 1.0F), full(0.04F, 0.20F, 0.78F);
  return none + std::clamp(s, 0.0F, 1.0F) * (full - none);
}

// Chosen by search: no two nearer than 0.138 in OKLab to any eye (tests/client/view/test_hues.cpp), none near steel or the body.
Vec3f station_color(std::size_t index) {
  static const std::array<Vec3f, kStationColors> kPalette{
      Vec3f(0.06F, 0.60F, 0.66F), Vec3f(0.37F, 0.34F, 0.78F), Vec3f(0.03F, 0.30F, 0.01F), Vec3f(0.61F, 0.72F, 0.08F),
      Vec3f(0.30F, 0.03F, 0.48F), Vec3f(0.00F, 0.85F, 0.76F), Vec3f(0.48F, 0.29F, 0.42F), Vec3f(0.44F, 0.51F, 0.02F)};
  return kPalette[index % kPalette.size()];
}

Vec3f thread_color() { return {0.04F, 0.07F, 0.42F}; }

Vec3f wall_color() { return {0.66F, 0.36F, 0.37F}; }

Vec3f held_color() { return {0.10F, 0.115F, 0.14F}; }

const Theme& theme(bool dark) {
  static const Theme kLight{.background_top = Vec3f(0.86F, 0.89F, 0.92F),
                            .background_bottom = Vec3f(0.965F, 0.965F, 0.96F),
                            .key = Vec3f(2.35F, 2.25F, 2.10F),
                            .fill = Vec3f(0.42F, 0.48F, 0.58F),
                            .rim = Vec3f(0.75F, 0.80F, 0.90F),
                            .sky = Vec3f(0.66F, 0.70F, 0.76F),
                            .floor = Vec3f(0.38F, 0.35F, 0.33F),
                            .ink = Vec3f(0.11F, 0.13F, 0.16F),
                            .ink_soft = Vec3f(0.36F, 0.40F, 0.45F),
                            .accent = Vec3f(0.06F, 0.52F, 0.60F),
                            .grid = Vec3f(0.30F, 0.36F, 0.42F),
                            .grid_strength = 0.20F,
                            .shadow_strength = 0.50F};
  static const Theme kDark{.background_top = Vec3f(0.055F, 0.065F, 0.085F),
                           .background_bottom = Vec3f(0.155F, 0.17F, 0.20F),
                           .key = Vec3f(2.30F, 2.15F, 1.95F),
                           .fill = Vec3f(0.22F, 0.28F, 0.40F),
                           .rim = Vec3f(0.50F, 0.62F, 0.85F),
                           .sky = Vec3f(0.34F, 0.38F, 0.45F),
                           .floor = Vec3f(0.15F, 0.13F, 0.13F),
                           .ink = Vec3f(0.93F, 0.94F, 0.96F),
                           .ink_soft = Vec3f(0.62F, 0.66F, 0.72F),
                           .accent = Vec3f(0.20F, 0.72F, 0.78F),
                           .grid = Vec3f(0.60F, 0.68F, 0.78F),
                           .grid_strength = 0.16F,
                           .shadow_strength = 0.72F};
  return dark ? kDark : kLight;
}

}  // namespace palpate
