#include "client/view/lights.hpp"

#include <Eigen/Geometry>

namespace palpate {
namespace {

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

}  // namespace

Lights lights_of(const Box& rest, const Camera& camera, const Look& look, float aspect, float density) {
  const float size = rest.diagonal(), radius = 0.85F * size;
  const Vec3f over = rest.center() + Vec3f(0, 0, 0.15F * size);
  const Eigen::Matrix3f axis = camera.axes();
  return {.theme = theme(look.dark),
          .view_projection = camera.projection(aspect) * camera.view(),
          .key_matrix = light_matrix(kKeyDirection, over, radius),
          .sky_matrix = light_matrix(Vec3f::UnitZ(), over, radius),
          .eye = camera.eye(),
          .fill_direction = (0.8F * axis.col(0) + 0.25F * axis.col(1) + 0.55F * axis.col(2)).normalized(),
          .rim_direction = (0.35F * axis.col(0) + 0.6F * axis.col(1) - 0.7F * axis.col(2)).normalized(),
          .floor_center = Vec3f(rest.center().x(), rest.center().y(), rest.low.z() - 0.002F * size),
          .size = size,
          .floor_reach = 1.6F * size,
          .taps = look.shadow_taps,
          .line_pixels = density / static_cast<float>(look.smooth_edges ? 1 : look.pixel)};
}

void light(const GlProgram& program, const Lights& lights) {
  const Theme& t = lights.theme;
  program.use();
  program.set("u_view_projection", lights.view_projection);
  program.set("u_eye", lights.eye);
  program.set("u_key_direction", kKeyDirection);
  program.set("u_fill_direction", lights.fill_direction);
  program.set("u_rim_direction", lights.rim_direction);
  program.set("u_key", t.key);
  program.set("u_fill", t.fill);
  program.set("u_rim", t.rim);
  program.set("u_sky", t.sky);
  program.set("u_floor", t.floor);
  program.set("u_key_map", 0);
  program.set("u_key_matrix", lights.key_matrix);
  program.set("u_taps", lights.taps);
}

}  // namespace palpate
