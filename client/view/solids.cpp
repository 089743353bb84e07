#include "client/view/solids.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/viewer/color.hpp"

namespace palpate {
namespace {

constexpr int kSides = 28;
constexpr float kSharedNormalCosine = 0.7F;

using Vec2f = Eigen::Vector2f;  // (radial, axial)

Vec2f stretch_normal(const Ring& a, const Ring& b) {
  const Vec2f n(b.height - a.height, a.radius - b.radius);
  return n.norm() > 0 ? Vec2f(n.normalized()) : Vec2f(0, 1);
}

Vec2f shared(const Vec2f& own, const Vec2f& neighbour) {
  return own.dot(neighbour) > kSharedNormalCosine ? Vec2f((own + neighbour).normalized()) : own;
}

const Vec3f kGrip(0.16F, 0.17F, 0.19F);

/// Appends a short rocker along the grip, on the side of x: it shows the roll of the stylus, and whether a button is pressed.
void append_button(SolidMesh& mesh, const Stylus& stylus) {
  const Vec3f idle(0.42F, 0.44F, 0.47F), color = stylus.pressed ? stylus.color : idle;
  const float r = stylus.tip_radius, sunk = stylus.pressed ? 0.62F : 0.80F;
  std::vector<Ring> profile{{0.00F, -1.6F, color, 0.4F}, {0.30F, -1.5F, color, 0.4F}, {0.42F, -1.2F, color, 0.4F},
                            {0.42F, 1.2F, color, 0.4F},  {0.30F, 1.5F, color, 0.4F},  {0.00F, 1.6F, color, 0.4F}};
  for (Ring& ring : profile) {
    ring.radius *= r;
    ring.height *= r;
  }
  const Vec3f side = stylus.axes->col(0), along = stylus.axes->col(2);
  append_turned(mesh, stylus.tip + r * (13.6F * along + sunk * side), along, profile);
}

}  // namespace

void append_turned(SolidMesh& mesh, const Vec3f& base, const Vec3f& axis, const std::vector<Ring>& profile) {
  const Vec3f z = axis.normalized(), x = z.unitOrthogonal(), y = z.cross(x);
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const Ring &a = profile[i], &b = profile[i + 1];
    const Vec2f own = stretch_normal(a, b);
    const Vec2f at_a = i > 0 ? shared(own, stretch_normal(profile[i - 1], a)) : own;
    const Vec2f at_b = i + 2 < profile.size() ? shared(own, stretch_normal(b, profile[i + 2])) : own;
    const Vec3f color = to_linear(a.color);
    for (int side = 0; side < kSides; ++side) {
      const auto vertex = [&](const Ring& ring, const Vec2f& normal, int k) {
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
        const Vec3f out = std::cos(angle) * x + std::sin(angle) * y;
        return SolidVertex{base + ring.radius * out + ring.height * z, normal.x() * out + normal.y() * z, color, a.gloss};
      };
      const SolidVertex a0 = vertex(a, at_a, side), a1 = vertex(a, at_a, side + 1);
      const SolidVertex b0 = vertex(b, at_b, side), b1 = vertex(b, at_b, side + 1);
      mesh.insert(mesh.end(), {a0, a1, b1, a0, b1, b0});
    }
  }
}

void append_stylus(SolidMesh& mesh, const Stylus& stylus) {
  const Vec3f steel(0.72F, 0.74F, 0.77F), grip = kGrip, lean = Vec3f(0.50F, 0.36F, 0.79F), collar_srgb = stylus.color;
  std::vector<Ring> profile;
  constexpr int kArc = 10;
  for (int i = 0; i < kArc; ++i) {
    const float angle = 0.86F * std::numbers::pi_v<float> * static_cast<float>(i) / (kArc - 1);
    profile.push_back({std::sin(angle), -std::cos(angle), Vec3f(0.93F, 0.93F, 0.92F), 0.9F});
  }
  profile.back().color = steel;
  profile.insert(profile.end(), {{0.40F, 1.3F, steel, 0.9F},
                                 {0.44F, 7.0F, steel, 0.9F},
                                 {0.95F, 9.0F, collar_srgb, 0.5F},
                                 {1.00F, 9.15F, collar_srgb, 0.5F},
                                 {1.00F, 10.6F, grip, 0.25F},
                                 {0.90F, 10.75F, grip, 0.25F},
                                 {1.08F, 12.6F, grip, 0.25F},
                                 {0.92F, 22.0F, steel, 0.8F},
                                 {0.92F, 22.6F, grip, 0.25F},
                                 {0.60F, 23.2F, grip, 0.25F},
                                 {0.00F, 23.4F, grip, 0.25F}});
  for (Ring& ring : profile) {
    ring.radius *= stylus.tip_radius;
    ring.height *= stylus.tip_radius;
  }
  append_turned(mesh, stylus.tip, stylus.axes ? Vec3f(stylus.axes->col(2)) : lean, profile);
  if (stylus.axes) append_button(mesh, stylus);
}

void append_instrument(SolidMesh& mesh, const Instrument& instrument) {
  const Vec3f steel(0.72F, 0.74F, 0.77F);
  constexpr int kArc = 12;
  const auto at = [&](const ToolSphere& sphere) { return Vec3f(instrument.pose.centre_of(sphere).cast<float>()); };
  float top = 0;
  for (std::size_t k = 0; k < instrument.body.size(); ++k) {
    const ToolSphere& sphere = instrument.body[k];
    const auto radius = static_cast<float>(sphere.radius_m);
    std::vector<Ring> ball;
    for (int i = 0; i <= kArc; ++i) {
      const float angle = std::numbers::pi_v<float> * static_cast<float>(i) / kArc;
      ball.push_back({radius * std::sin(angle), -radius * std::cos(angle), steel, 0.9F});
    }
    append_turned(mesh, at(sphere), Vec3f::UnitZ(), ball);
    top = std::max(top, static_cast<float>(sphere.centre.z()) + radius);
    if (k + 1 == instrument.body.size()) continue;
    const ToolSphere& next = instrument.body[k + 1];
    if (next.radius_m != sphere.radius_m || next.swing_rad != sphere.swing_rad) continue;
    const Vec3f way = at(next) - at(sphere);
    if (way.norm() > 0) append_turned(mesh, at(sphere), way, {{radius, 0, steel, 0.9F}, {radius, way.norm(), steel, 0.9F}});
  }
  constexpr float kHandleM = 0.08F, kRodM = 0.0016F, kCollarM = 0.012F, kGripM = 0.0032F;
  const float end = top + kHandleM;
  append_turned(mesh, instrument.pose.position.cast<float>(), (instrument.pose.turn * Vec3::UnitZ()).cast<float>(),
                {{kRodM, 0.5F * top, steel, 0.9F},
                 {kRodM, end - 3 * kCollarM, steel, 0.9F},
                 {kGripM, end - 3 * kCollarM, instrument.color, 0.5F},
                 {kGripM, end - 2 * kCollarM, instrument.color, 0.5F},
                 {kGripM, end - 2 * kCollarM, kGrip, 0.25F},
                 {kGripM, end, kGrip, 0.25F},
                 {0, end + kGripM, kGrip, 0.25F}});
}

void append_arrow(SolidMesh& mesh, const Vec3f& from, const Vec3f& along, float width, const Vec3f& color_srgb) {
  const float length = along.norm();
  if (!(length > width)) return;
  const float head = std::min(2.6F * width, 0.6F * length), gloss = 0.35F;
  append_turned(mesh, from, along,
                {{0, 0, color_srgb, gloss},
                 {0.32F * width, 0, color_srgb, gloss},
                 {0.32F * width, length - head, color_srgb, gloss},
                 {0.95F * width, length - head, color_srgb, gloss},
                 {0, length, color_srgb, gloss}});
}

void append_part(SolidMesh& mesh, const PartMesh& part) {
  constexpr float kSharp = 0.87F, kGloss = 0.15F;  // cosine of the angle beyond which an edge is sharp
  const Vec3f color = to_linear(srgb_of(part.colour));
  const BodyMesh& body = part.mesh;
  const auto corner = [&](std::uint32_t i) { return Vec3f(body.vertices[i].rest.cast<float>()); };
  std::vector<Vec3f> across;
  std::vector<std::vector<std::uint32_t>> around(body.vertices.size());
  for (std::uint32_t t = 0; t < body.triangles.size(); ++t) {
    const Triangle& v = body.triangles[t];
    across.push_back((corner(v[1]) - corner(v[0])).cross(corner(v[2]) - corner(v[0])));
    for (const std::uint32_t i : v) around[i].push_back(t);
  }
  for (std::uint32_t t = 0; t < body.triangles.size(); ++t)
    for (const std::uint32_t i : body.triangles[t]) {
      Vec3f normal = across[t];
      for (const std::uint32_t other : around[i])
        if (other != t && across[other].normalized().dot(across[t].normalized()) > kSharp) normal += across[other];
      mesh.push_back({corner(i), normal.normalized(), color, kGloss});
    }
}

}  // namespace palpate
