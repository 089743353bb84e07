#include "client/view/ground.hpp"

#include <epoxy/gl.h>

#include "client/view/round_125.hpp"
#include "client/view/shaders.hpp"

namespace palpate {
namespace {

constexpr int kWideMapSize = 256, kShadowSize = 128;

void copy_depth(const GlTarget& from, const GlTarget& to) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, from.framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.framebuffer());
  glBlitFramebuffer(0, 0, from.width(), from.height(), 0, 0, to.width(), to.height(), GL_DEPTH_BUFFER_BIT, GL_NEAREST);
}

}  // namespace

Ground::Ground()
    : shadow_("floor shadow", shaders::background_vertex(), shaders::floor_shadow_fragment()),
      floor_("floor", shaders::floor_vertex(), shaders::floor_fragment()),
      background_("background", shaders::background_vertex(), shaders::background_fragment()),
      wide_key_map_(kWideMapSize, kWideMapSize, GlTarget::Use::shadow_map),
      shadow_map_(kShadowSize, kShadowSize, GlTarget::Use::texture) {}

float Ground::grid_spacing(float size) { return round_up_125(0.06F * size); }

void Ground::cast(const GlTarget& key_map, const GlTarget& sky_map, const Lights& lights) {
  copy_depth(key_map, wide_key_map_);
  shadow_map_.bind();
  bind_texture(0, wide_key_map_.texture());
  bind_texture(1, sky_map.texture());
  shadow_.use();
  shadow_.set("u_key_map", 0);
  shadow_.set("u_sky_map", 1);
  shadow_.set("u_key_matrix", lights.key_matrix);
  shadow_.set("u_sky_matrix", lights.sky_matrix);
  shadow_.set("u_taps", lights.taps * 5 / 2);
  shadow_.set("u_center", lights.floor_center);
  shadow_.set("u_reach", lights.floor_reach);
  glDisable(GL_DEPTH_TEST);
  glBindVertexArray(corners_.id());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glEnable(GL_DEPTH_TEST);
}

void Ground::draw(const Lights& lights) const {
  glDepthRange(1, 1);
  glDepthFunc(GL_LEQUAL);
  glBindVertexArray(corners_.id());
  draw_background(lights);
  if (lights.eye.z() > lights.floor_center.z()) draw_floor(lights);
  glDepthFunc(GL_LESS);
  glDepthRange(0, 1);
}

void Ground::draw_background(const Lights& lights) const {
  background_.use();
  background_.set("u_top", lights.theme.background_top);
  background_.set("u_bottom", lights.theme.background_bottom);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void Ground::draw_floor(const Lights& lights) const {
  floor_.use();
  bind_texture(0, shadow_map_.texture());
  floor_.set("u_shadow", 0);
  floor_.set("u_view_projection", lights.view_projection);
  floor_.set("u_center", lights.floor_center);
  floor_.set("u_reach", lights.floor_reach);
  floor_.set("u_spacing", grid_spacing(lights.size));
  floor_.set("u_line", lights.line_pixels);
  floor_.set("u_grid", lights.theme.grid);
  floor_.set("u_grid_strength", lights.theme.grid_strength);
  floor_.set("u_shadow_strength", lights.theme.shadow_strength);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

}  // namespace palpate
