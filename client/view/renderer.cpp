#include "client/view/renderer.hpp"

#include <epoxy/gl.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "client/view/shaders.hpp"

namespace palpate {

struct Renderer::Lights {
  const Theme& theme;
  const Camera& camera;
  Eigen::Matrix4f view_projection, key_matrix, sky_matrix;
  Vec3f floor_center;
  float floor_reach, grid_spacing;
  int taps;
  float line_pixels;  ///< width of a thin line
};

namespace {

constexpr int kMapSize = 1024, kWideMapSize = 256, kSkyMapSize = 128, kFloorMapSize = 128;
constexpr int kMaxLevel = 4;
const Vec3f kKeyDirection = Vec3f(-0.36F, -0.50F, 0.79F).normalized();

/// Orthographic light around a sphere, looking along -direction.
Eigen::Matrix4f light_matrix(const Vec3f& direction, const Vec3f& center, float radius) {
  const Vec3f x = direction.unitOrthogonal(), y = direction.cross(x);
  Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
  m.block<1, 3>(0, 0) = x.transpose() / radius;
  m.block<1, 3>(1, 0) = y.transpose() / radius;
  m.block<1, 3>(2, 0) = -direction.transpose() / (2 * radius);
  m.topRightCorner<3, 1>() = -m.topLeftCorner<3, 3>() * center;
  return m;
}

/// Corners of the level^2 equal parts of a triangle, as weights of its corners.
std::vector<Vec3f> refinement(int level) {
  std::vector<Vec3f> pattern;
  const auto at = [level](int i, int j) -> Vec3f {
    return Vec3f(static_cast<float>(level - i - j), static_cast<float>(i), static_cast<float>(j)) / static_cast<float>(level);
  };
  for (int i = 0; i < level; ++i) {
    for (int j = 0; i + j < level; ++j) {
      pattern.insert(pattern.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < level) pattern.insert(pattern.end(), {at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return pattern;
}

void attribute(GLuint index, int size, int stride_floats, int offset_floats) {
  glEnableVertexAttribArray(index);
  glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, stride_floats * static_cast<int>(sizeof(float)),
                        reinterpret_cast<const void*>(static_cast<std::uintptr_t>(offset_floats) * sizeof(float)));
}

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

void copy_depth(const GlTarget& from, const GlTarget& to) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.framebuffer());
  glBlitFramebuffer(0, 0, from.width(), from.height(), 0, 0, to.width(), to.height(), GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

void bind_texture(int unit, GlId texture) {
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture);
}

}  // namespace

float round_up_125(float x) {
  const float decade = std::pow(10.0F, std::floor(std::log10(x)));
  for (const float step : {1.0F, 2.0F, 5.0F}) {
    if (x <= step * decade * 1.0001F) return step * decade;
  }
  return 10 * decade;
}

float round_down_125(float x) {
  const float decade = std::pow(10.0F, std::floor(std::log10(x)));
  for (const float step : {5.0F, 2.0F}) {
    if (x * 1.0001F >= step * decade) return step * decade;
  }
  return decade;
}

float Renderer::grid_spacing(const Box& box) { return round_up_125(0.06F * box.diagonal()); }

Renderer::Renderer(float density)
    : solid_("solid", shaders::solid_vertex(), shaders::solid_fragment()),
      floor_shadow_("floor shadow", shaders::background_vertex(), shaders::floor_shadow_fragment()),
      floor_("floor", shaders::floor_vertex(), shaders::floor_fragment()),
      background_("background", shaders::background_vertex(), shaders::background_fragment()),
      plain_depth_("body depth", shaders::plain_body_vertex(), shaders::depth_fragment()),
      curved_depth_("body depth", shaders::curved_body_vertex(), shaders::depth_fragment()),
      solid_depth_("solid depth", shaders::solid_vertex(), shaders::depth_fragment()),
      key_map_(kMapSize, kMapSize, GlTarget::Use::shadow_map),
      wide_key_map_(kWideMapSize, kWideMapSize, GlTarget::Use::shadow_map),
      sky_map_(kSkyMapSize, kSkyMapSize, GlTarget::Use::shadow_map),
      floor_map_(kFloorMapSize, kFloorMapSize, GlTarget::Use::texture),
      density_(density) {
  fill_color_texture(colors_);
  constexpr int kCornerFloats = sizeof(Corner) / sizeof(float);
  static_assert(kCornerFloats == 12, "Corner is four packed vectors");
  glBindVertexArray(plain_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, corner_buffer_.id());
  for (GLuint i = 0; i < 4; ++i) attribute(i, 3, kCornerFloats, 3 * static_cast<int>(i));
  // The strain of a triangle is the same at its three corners: the first one's serves.
  glBindVertexArray(curved_array_.id());
  for (GLuint i = 0; i < 10; ++i) {
    attribute(i, 3, 3 * kCornerFloats, 3 * static_cast<int>(i < 7 ? i : i + 1));
    glVertexAttribDivisor(i, 1);
  }
  glBindBuffer(GL_ARRAY_BUFFER, pattern_buffer_.id());
  attribute(10, 3, 3, 0);
  constexpr int kSolidFloats = sizeof(SolidVertex) / sizeof(float);
  static_assert(kSolidFloats == 10, "SolidVertex is ten packed floats");
  glBindVertexArray(solid_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, solid_buffer_.id());
  for (GLuint i = 0; i < 3; ++i) attribute(i, 3, kSolidFloats, 3 * static_cast<int>(i));
  attribute(3, 1, kSolidFloats, 9);
}

void Renderer::refine(const Look& look) {
  const double affordable = std::sqrt(static_cast<double>(look.triangle_budget) / std::max(1, triangles_));
  const int level = std::clamp(static_cast<int>(affordable), 1, kMaxLevel);
  if (level == level_) return;
  const std::vector<Vec3f> pattern = refinement(level);
  upload(pattern_buffer_, std::as_bytes(std::span(pattern)));
  pattern_vertices_ = static_cast<int>(pattern.size());
  level_ = level;
}

void Renderer::upload_body(const Sight& sight, const Look& look) {
  update_surface(sight.triangles, sight.positions, surface_);
  triangles_ = static_cast<int>(sight.triangles.size());
  refine(look);
  corners_.resize(3 * sight.triangles.size());
  const auto look_of = [&](std::uint32_t i) -> Vec3f {
    const float shade = sight.shade.empty() ? (sight.positions[i] - sight.rest[i]).norm() : sight.shade[i];
    return {shade, surface_.cavity[i], !sight.vertices.empty() && sight.vertices[i].fixed ? 1.0F : 0.0F};
  };
  Corner* corner = corners_.data();
  for (const Triangle& t : sight.triangles) {
    Vec3f strain = Vec3f::Zero();
    for (std::size_t k = 0; look.lines == Lines::strain && k < 3; ++k) {
      const std::uint32_t from = t[(k + 1) % 3], to = t[(k + 2) % 3];
      const float length = (sight.rest[to] - sight.rest[from]).norm();
      if (length > 0) strain[static_cast<int>(k)] = (sight.positions[to] - sight.positions[from]).norm() / length - 1;
    }
    for (const std::uint32_t i : t) *corner++ = {sight.positions[i], surface_.normals[i], look_of(i), strain};
  }
  upload(corner_buffer_, std::as_bytes(std::span(corners_)));
}

void Renderer::upload_solids(const Sight& sight, const Box& rest) {
  solids_.clear();
  const float tip = tip_radius(rest);
  for (std::size_t i = 0; i < sight.tools.size(); ++i) {
    const ToolView& tool = sight.tools[i];
    const Vec3f at = tool.position.cast<float>(), force = tool.force.cast<float>();
    append_stylus(solids_, at, tip, station_color(i));
    if (tool.contact) append_arrow(solids_, at, sight.arrow_m_per_n * force, 1.1F * tip, station_color(i));
  }
  upload(solid_buffer_, std::as_bytes(std::span(solids_)));
}

void Renderer::draw_triangles() const {
  glBindVertexArray(plain() ? plain_array_.id() : curved_array_.id());
  if (plain())
    glDrawArrays(GL_TRIANGLES, 0, 3 * triangles_);
  else
    glDrawArraysInstanced(GL_TRIANGLES, 0, pattern_vertices_, triangles_);
}

void Renderer::draw_solids() const {
  glBindVertexArray(solid_array_.id());
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(solids_.size()));
}

void Renderer::draw_shadow(const GlTarget& map, const Eigen::Matrix4f& matrix, bool closed) {
  map.bind();
  glClear(GL_DEPTH_BUFFER_BIT);
  const GlProgram& body = plain() ? plain_depth_ : curved_depth_;
  body.use();
  body.set("u_view_projection", matrix);
  if (closed) glEnable(GL_CULL_FACE);
  draw_triangles();
  glDisable(GL_CULL_FACE);
  solid_depth_.use();
  solid_depth_.set("u_view_projection", matrix);
  draw_solids();
}

void Renderer::light(const GlProgram& program, const Lights& lights) const {
  const Eigen::Matrix3f axis = lights.camera.axes();
  const Theme& t = lights.theme;
  program.use();
  program.set("u_view_projection", lights.view_projection);
  program.set("u_eye", lights.camera.eye());
  program.set("u_key_direction", kKeyDirection);
  program.set("u_fill_direction", Vec3f((0.8F * axis.col(0) + 0.25F * axis.col(1) + 0.55F * axis.col(2)).normalized()));
  program.set("u_rim_direction", Vec3f((0.35F * axis.col(0) + 0.6F * axis.col(1) - 0.7F * axis.col(2)).normalized()));
  program.set("u_key", t.key);
  program.set("u_fill", t.fill);
  program.set("u_rim", t.rim);
  program.set("u_sky", t.sky);
  program.set("u_floor", t.floor);
  program.set("u_key_map", 0);
  program.set("u_key_matrix", lights.key_matrix);
  program.set("u_taps", lights.taps);
}

void Renderer::draw_floor_shadow(const Lights& lights) {
  floor_map_.bind();
  bind_texture(0, wide_key_map_.texture());
  bind_texture(1, sky_map_.texture());
  floor_shadow_.use();
  floor_shadow_.set("u_key_map", 0);
  floor_shadow_.set("u_sky_map", 1);
  floor_shadow_.set("u_key_matrix", lights.key_matrix);
  floor_shadow_.set("u_sky_matrix", lights.sky_matrix);
  floor_shadow_.set("u_taps", lights.taps * 5 / 2);
  floor_shadow_.set("u_center", lights.floor_center);
  floor_shadow_.set("u_reach", lights.floor_reach);
  glDisable(GL_DEPTH_TEST);
  glBindVertexArray(empty_array_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void Renderer::draw_background(const Lights& lights) const {
  background_.use();
  background_.set("u_top", lights.theme.background_top);
  background_.set("u_bottom", lights.theme.background_bottom);
  glBindVertexArray(empty_array_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void Renderer::draw_floor(const Lights& lights) const {
  if (lights.camera.eye().z() <= lights.floor_center.z()) return;
  floor_.use();
  bind_texture(0, floor_map_.texture());
  floor_.set("u_shadow", 0);
  floor_.set("u_view_projection", lights.view_projection);
  floor_.set("u_center", lights.floor_center);
  floor_.set("u_reach", lights.floor_reach);
  floor_.set("u_spacing", lights.grid_spacing);
  floor_.set("u_line", lights.line_pixels);
  floor_.set("u_grid", lights.theme.grid);
  floor_.set("u_grid_strength", lights.theme.grid_strength);
  floor_.set("u_shadow_strength", lights.theme.shadow_strength);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

void Renderer::bind_samples(const Look& look, int width, int height) {
  const GlTarget::Use use = look.smooth_edges ? GlTarget::Use::multisampled : GlTarget::Use::picture;
  const int pixel = look.smooth_edges ? 1 : look.pixel;
  width = std::max(1, width / pixel);
  height = std::max(1, height / pixel);
  if (!samples_ || samples_->width() != width || samples_->height() != height || samples_->use() != use)
    samples_ = std::make_unique<GlTarget>(width, height, use);
  samples_->bind();
  glClear(GL_DEPTH_BUFFER_BIT);
}

void Renderer::draw_body(const Sight& sight, const Lights& lights, const Look& look, float size) {
  const int lines = static_cast<int>(look.lines);
  std::optional<GlProgram>& program = body_[static_cast<std::size_t>(plain() ? lines : 3 + lines)];
  if (!program)
    program.emplace("body", plain() ? shaders::plain_body_vertex() : shaders::curved_body_vertex(),
                    shaders::body_fragment(lines));
  bind_texture(0, key_map_.texture());
  bind_texture(1, colors_.id());
  light(*program, lights);
  program->set("u_colors", 1);
  program->set("u_color_max", sight.color_max);
  program->set("u_floor_z", lights.floor_center.z());
  program->set("u_size", size);
  program->set("u_line", lights.line_pixels);
  program->set("u_strain_max", kStrainMax);
  program->set("u_pushed", strain_colors().pushed);
  program->set("u_slack", strain_colors().slack);
  program->set("u_pulled", strain_colors().pulled);
  program->set("u_bias", 0.007F * size);
  if (sight.closed) glEnable(GL_CULL_FACE);
  draw_triangles();
  glDisable(GL_CULL_FACE);
}

void Renderer::draw(const Sight& sight, const Camera& camera, const Look& look, int width, int height, GlId target) {
  const Box rest = bounds(sight.triangles, sight.rest);
  const float size = rest.diagonal(), light_radius = 0.85F * size;
  upload_body(sight, look);
  upload_solids(sight, rest);
  const Vec3f over = rest.center() + Vec3f(0, 0, 0.15F * size);
  const Lights lights{
      .theme = theme(look.dark),
      .camera = camera,
      .view_projection = camera.projection(static_cast<float>(width) / static_cast<float>(height)) * camera.view(),
      .key_matrix = light_matrix(kKeyDirection, over, light_radius),
      .sky_matrix = light_matrix(Vec3f::UnitZ(), over, light_radius),
      .floor_center = Vec3f(rest.center().x(), rest.center().y(), rest.low.z() - 0.002F * size),
      .floor_reach = 1.6F * size,
      .grid_spacing = grid_spacing(rest),
      .taps = look.shadow_taps,
      .line_pixels = density_ / static_cast<float>(look.smooth_edges ? 1 : look.pixel)};
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  draw_shadow(key_map_, lights.key_matrix, sight.closed);
  copy_depth(key_map_, wide_key_map_);
  draw_shadow(sky_map_, lights.sky_matrix, sight.closed);
  draw_floor_shadow(lights);

  bind_samples(look, width, height);
  glEnable(GL_DEPTH_TEST);
  draw_body(sight, lights, look, size);
  light(solid_, lights);
  draw_solids();
  // Only where nothing is yet: what is covered costs no shading.
  glDepthRange(1, 1);
  glDepthFunc(GL_LEQUAL);
  draw_background(lights);
  draw_floor(lights);
  glDepthFunc(GL_LESS);
  glDepthRange(0, 1);

  glBindFramebuffer(GL_READ_FRAMEBUFFER, samples_->framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
  const bool same = samples_->width() == width && samples_->height() == height;
  glBlitFramebuffer(0, 0, samples_->width(), samples_->height(), 0, 0, width, height, GL_COLOR_BUFFER_BIT,
                    same ? GL_NEAREST : GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glBindVertexArray(0);
}

}  // namespace palpate
