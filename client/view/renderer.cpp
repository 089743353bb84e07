#include "client/view/renderer.hpp"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/view/round_125.hpp"
#include "client/view/shaders.hpp"
#include "client/viewer/color.hpp"

namespace palpate {
namespace {

constexpr int kKeyMapSize = 1024, kSkyMapSize = 128;

void fill_color_texture(const GlTexture& texture) {
  std::array<std::uint8_t, 256 * 3> texels{};
  for (std::size_t i = 0; i < 256; ++i) {
    const Vec3f c = displacement_color(static_cast<float>(i) / 255.0F);
    for (std::size_t k = 0; k < 3; ++k) texels[3 * i + k] = static_cast<std::uint8_t>(std::lround(255 * c[static_cast<int>(k)]));
  }
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8, 256, 1, 0, GL_RGB, GL_UNSIGNED_BYTE, texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
}

std::vector<Vec3f> linear_colors(std::span<const BodyName> bodies) {
  std::vector<Vec3f> colors;
  for (const BodyName& body : bodies) colors.push_back(to_linear(srgb_of(body.colour)));
  return colors;
}

}  // namespace

Renderer::Renderer(float density)
    : solid_("solid", shaders::solid_vertex(), shaders::solid_fragment()),
      plain_depth_("body depth", shaders::plain_body_vertex(), shaders::depth_fragment()),
      curved_depth_("body depth", shaders::curved_body_vertex(), shaders::depth_fragment()),
      solid_depth_("solid depth", shaders::solid_vertex(), shaders::depth_fragment()),
      key_map_(kKeyMapSize, kKeyMapSize, GlTarget::Use::shadow_map),
      sky_map_(kSkyMapSize, kSkyMapSize, GlTarget::Use::shadow_map),
      density_(density) {
  fill_color_texture(colors_);
}

void Renderer::draw_shadow(const GlTarget& map, const Eigen::Matrix4f& matrix) const {
  map.bind();
  glClear(GL_DEPTH_BUFFER_BIT);
  const GlProgram& body = body_batch_.plain() ? plain_depth_ : curved_depth_;
  body.use();
  body.set("u_view_projection", matrix);
  body_batch_.draw();
  solid_depth_.use();
  solid_depth_.set("u_view_projection", matrix);
  solid_batch_.draw();
}

void Renderer::bind_samples(const Shown& shown) {
  const GlTarget::Use use = shown.smooth_edges ? GlTarget::Use::multisampled : GlTarget::Use::picture;
  const int width = std::max(1, shown.width / shown.pixel), height = std::max(1, shown.height / shown.pixel);
  if (!samples_ || samples_->width() != width || samples_->height() != height || samples_->use() != use)
    samples_ = std::make_unique<GlTarget>(width, height, use);
  samples_->bind();
  glClear(GL_DEPTH_BUFFER_BIT);
}

void Renderer::draw_body(const Shown& shown) {
  const int lines = static_cast<int>(shown.lines);
  const bool plain = body_batch_.plain();
  std::optional<GlProgram>& program = body_[static_cast<std::size_t>(plain ? lines : 3 + lines)];
  if (!program)
    program.emplace("body", plain ? shaders::plain_body_vertex() : shaders::curved_body_vertex(), shaders::body_fragment(lines));
  bind_texture(0, key_map_.texture());
  bind_texture(1, colors_.id());
  light(*program, shown.lights);
  program->set("u_colors", 1);
  program->set("u_color_max", shown.color_max);
  program->set("u_contour", contour_step(shown.color_max));
  program->set("u_held", held_color());
  program->set("u_wall", wall_color());
  program->set("u_several", shown.bodies.empty() ? 0 : 1);
  for (std::size_t i = 0; i < shown.bodies.size(); ++i) program->set(fmt::format("u_bodies[{}]", i).c_str(), shown.bodies[i]);
  program->set("u_thread", thread_color());
  program->set("u_floor_z", shown.lights.floor_center.z());
  program->set("u_size", shown.lights.size);
  program->set("u_line", shown.lights.line_pixels);
  program->set("u_strain_max", kStrainMax);
  program->set("u_pushed", strain_colors().pushed);
  program->set("u_slack", strain_colors().slack);
  program->set("u_pulled", strain_colors().pulled);
  program->set("u_bias", 0.007F * shown.lights.size);
  body_batch_.draw();
}

// Draws arrows faintly through the body: a pulled body pulls the tool back, so the arrow points into it.
void Renderer::draw_hidden_arrows(const Lights& lights) const {
  constexpr float kFaint = 0.6F;
  light(solid_, lights);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendColor(0, 0, 0, kFaint);
  glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  glEnable(GL_CULL_FACE);
  solid_batch_.draw_arrows();
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_LESS);
}

void Renderer::draw_solids(const Lights& lights) const {
  light(solid_, lights);
  solid_batch_.draw();
}

void Renderer::resolve(int width, int height, GlId target) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_->framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
  const bool same = samples_->width() == width && samples_->height() == height;
  glBlitFramebuffer(0, 0, samples_->width(), samples_->height(), 0, 0, width, height, GL_COLOR_BUFFER_BIT,
                    same ? GL_NEAREST : GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glBindVertexArray(0);
}

void Renderer::draw(const Sight& sight, const Camera& camera, const Look& look, int width, int height, GlId target) {
  const Box rest = bounds(sight.triangles, sight.rest);
  const bool body_moved = body_batch_.show(sight, look), solids_moved = solid_batch_.show(sight, rest);
  const bool moved = body_moved || solids_moved || !shown_;
  const Shown shown{.lights = lights_of(rest, camera, look, static_cast<float>(width) / static_cast<float>(height), density_),
                    .bodies = linear_colors(sight.bodies),
                    .color_max = sight.color_max,
                    .lines = look.lines,
                    .smooth_edges = look.smooth_edges,
                    .width = width,
                    .height = height,
                    .pixel = look.smooth_edges ? 1 : look.pixel};
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  if (moved || shown.lights.taps != shown_->lights.taps) {
    draw_shadow(key_map_, shown.lights.key_matrix);
    draw_shadow(sky_map_, shown.lights.sky_matrix);
    ground_.cast(key_map_, sky_map_, shown.lights);
  }
  if (moved || shown != *shown_) {
    bind_samples(shown);
    draw_body(shown);
    draw_hidden_arrows(shown.lights);
    draw_solids(shown.lights);
    ground_.draw(shown.lights);
    shown_ = shown;
    ++drawn_;
  }
  resolve(width, height, target);
}

}  // namespace palpate
