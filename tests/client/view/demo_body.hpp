// A soft organ-like body for picture tests: a triangulated ellipsoid pressed by a ball-tipped tool, in closed form.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <vector>

#include "client/view/sight.hpp"
#include "server/core/room_info.hpp"

namespace palpate::demo {

struct Body {
  std::vector<Triangle> triangles;
  std::vector<Vec3f> rest, positions;
  std::vector<ToolView> tools;
};

/// A subdivided octahedron on the unit sphere: 8 * 4^levels triangles, counter-clockwise seen from outside.
inline Body unit_sphere(int levels) {
  Body body;
  body.rest = {Vec3f::UnitX(), -Vec3f::UnitX(), Vec3f::UnitY(), -Vec3f::UnitY(), Vec3f::UnitZ(), -Vec3f::UnitZ()};
  body.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(body.rest.size()));
      if (fresh) body.rest.push_back((body.rest[a] + body.rest[b]).normalized());
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : body.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    body.triangles = finer;
  }
  body.positions = body.rest;
  return body;
}

/// A liver-like shape, 160 mm long, indented by `depth_m` where a tool presses with `force_n`.
inline Body pressed_organ(float depth_m, double force_n, int levels = 4) {
  Body body = unit_sphere(levels);
  for (Vec3f& p : body.rest) {
    const float taper = 1.0F - 0.30F * p.x() + 0.10F * std::sin(2.4F * p.x() + 0.6F) - 0.12F * p.y() * p.y();
    p = Vec3f(0.080F * p.x(), 0.055F * p.y() * taper + 0.012F * p.x() * p.x(),
              (p.z() > 0 ? 0.036F : 0.026F) * p.z() * taper + 0.03F);
  }
  std::size_t touched = 0;
  const Vec3f aim(-0.012F, -0.018F, 0.1F);
  for (std::size_t i = 0; i < body.rest.size(); ++i) {
    if ((body.rest[i] - aim).norm() < (body.rest[touched] - aim).norm()) touched = i;
  }
  const Vec3f at = body.rest[touched], down = Vec3f(0.10F, 0.16F, -1.0F).normalized();
  body.positions = body.rest;
  for (Vec3f& p : body.positions) {
    const float r = (p - at).norm();
    p += depth_m * down * (0.75F * std::exp(-r * r / (0.013F * 0.013F)) + 0.25F * std::exp(-r / 0.022F));
  }
  body.tools = {{"hand", body.positions[touched].cast<double>(), (-force_n * down).cast<double>(), force_n > 0}};
  return body;
}

/// Facts of a room around it, vertex i being node i; the lowest vertices are fixed.
inline RoomInfo facts_of(const Body& body) {
  RoomInfo facts;
  facts.scene = "demo";
  facts.nodes = static_cast<std::uint32_t>(body.rest.size());
  for (std::uint32_t i = 0; i < facts.nodes; ++i) {
    facts.vertex_of.push_back(i);
    facts.mesh.vertices.push_back({body.rest[i].cast<double>().unaryExpr(&to_rest_step), body.rest[i].z() < 0.022F});
  }
  facts.mesh.triangles = body.triangles;
  facts.mesh_hash = mesh_hash(facts.mesh);
  return facts;
}

inline Sight sight_of(const Body& body) {
  return {.triangles = body.triangles,
          .positions = body.positions,
          .rest = body.rest,
          .scalars = {},
          .vertices = {},
          .tools = body.tools,
          .closed = is_closed(body.triangles),
          .color_max = 0.01F,
          .arrow_m_per_n = 0.05F};
}

}  // namespace palpate::demo
