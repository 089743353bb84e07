#include "client/view/stage.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

#include "client/view/round_125.hpp"

namespace palpate {
namespace {

constexpr float kArrowShare = 0.24F;  // share of the body's diagonal, for the strongest force seen

float interface_scale(int width, int height, float density) {
  const float fit = std::min(static_cast<float>(width) / 1280.0F, static_cast<float>(height) / 800.0F) / density;
  return density * std::clamp(fit, 0.82F, 3.0F);
}

}  // namespace

float covered_by_panels(const Look& look, int width, int height, float density) {
  return look.panels ? panels_cover(static_cast<float>(width), interface_scale(width, height, density)) : 0;
}

void Scales::see(std::span<const Triangle> triangles, std::span<const Vec3f> positions, std::span<const Vec3f> rest,
                 std::span<const ToolView> tools, ShapeChannel channel, std::span<const float> scalars) {
  float moved = 0;
  for (const Triangle& t : triangles) {
    for (const std::uint32_t i : t) moved = std::max(moved, (positions[i] - rest[i]).norm());
  }
  float strongest = 0;
  for (const ToolView& tool : tools) strongest = std::max(strongest, static_cast<float>(tool.force.norm()));
  expect(moved, strongest);
  float& scalar_max = color_max_[static_cast<std::size_t>(channel)];
  for (const float s : scalars) scalar_max = std::max(scalar_max, round_up_125(std::max(s, 1e-4F)));
  const float wanted = kArrowShare * bounds(triangles, rest).diagonal() / force_peak_n_;
  arrow_m_per_n_ = round_down_125(wanted);
}

void Scales::expect(float displacement_m, float force_n) {
  float& displacement_max_m = color_max_[static_cast<std::size_t>(ShapeChannel::position)];
  displacement_max_m = std::max(displacement_max_m, round_up_125(std::max(displacement_m, 1e-4F)));
  force_peak_n_ = std::max(force_peak_n_, force_n);
}

void Scales::see_misses(std::span<const PatchPin> pins) {
  for (const PatchPin& pin : pins) miss_max_m_ = std::max(miss_max_m_, round_up_125(std::max(pin.miss.norm(), 1e-6F)));
}

Stage::Stage(int width, int height, float density) : renderer_(density), overlay_(interface_scale(width, height, density)) {}

void Stage::draw(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width, int height,
                 GlId target) {
  renderer_.draw(sight, camera, look, width, height, target);
  glViewport(0, 0, width, height);
  overlay_.draw(sight, caption, camera, look, width, height);
}

Picture Stage::photograph(const Sight& sight, const Caption& caption, const Camera& camera, const Look& look, int width,
                          int height) {
  if (!picture_ || picture_->width() != width || picture_->height() != height)
    picture_.emplace(width, height, GlTarget::Use::picture);
  draw(sight, caption, camera, look, width, height, picture_->framebuffer());
  const auto row = static_cast<std::size_t>(width) * 3;
  std::vector<std::uint8_t> bottom_up(row * static_cast<std::size_t>(height));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_->framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, bottom_up.data());
  Picture picture{width, height, std::vector<std::uint8_t>(bottom_up.size())};
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const auto from = bottom_up.end() - static_cast<std::ptrdiff_t>((y + 1) * row);
    std::copy_n(from, row, picture.rgb.begin() + static_cast<std::ptrdiff_t>(y * row));
  }
  return picture;
}

}  // namespace palpate
