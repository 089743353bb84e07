// Small lumped bodies and random states, without a scene file.
#pragma once

#include <array>
#include <vector>

#include "common/base/random.hpp"
#include "server/body/dynamics.hpp"

namespace palpate::test {

inline constexpr double kSpacingM = 0.02;

/// A box of nx x ny x nz nodes 20 mm apart, every node joined to its neighbours of a cell, the bottom fixed, with its outer
/// surface: the material of scenes/cube6.json.
inline LumpedBody box_body(int nx, int ny, int nz, double stiffness_n_m = 60, double damping_n_s_m = 0.24) {
  LumpedBody body;
  const auto id = [=](int i, int j, int k) { return static_cast<std::uint32_t>(i + nx * (j + ny * k)); };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        body.nodes.push_back(kSpacingM * Vec3(i, j, k));
        body.masses_kg.push_back(1.0 / 216);
        body.fixed.push_back(k == 0);
      }
  const auto join = [&](int i, int j, int k, int di, int dj, int dk) {
    const int p = i + di, q = j + dj, r = k + dk;
    if (p < 0 || q < 0 || p >= nx || q >= ny || r >= nz) return;
    const std::uint32_t a = id(i, j, k), b = id(p, q, r);
    body.elements.push_back({a, b, (body.nodes[b] - body.nodes[a]).norm(), stiffness_n_m, damping_n_s_m});
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (int n = 14; n < 27; ++n) join(i, j, k, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);

  const std::array<int, 3> size{nx, ny, nz};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool high : {false, true}) {
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;  // u x v points along +axis
      for (int p = 0; p + 1 < size[u]; ++p)
        for (int q = 0; q + 1 < size[v]; ++q) {
          const auto corner = [&](int dp, int dq) {
            std::array<int, 3> at{};
            at[axis] = high ? size[axis] - 1 : 0;
            at[u] = p + dp;
            at[v] = q + dq;
            return id(at[0], at[1], at[2]);
          };
          const std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          body.triangles.push_back(high ? Triangle{a, b, c} : Triangle{a, c, b});
          body.triangles.push_back(high ? Triangle{a, c, d} : Triangle{a, d, c});
        }
    }
  return body;
}

/// The same box filled with tetrahedra, six per cell around its diagonal (Kuhn), masses lumped.
inline LumpedBody solid_box(int nx, int ny, int nz, const SolidMaterial& material, double density_kg_m3 = 1000) {
  LumpedBody body = box_body(nx, ny, nz);
  body.elements.clear();
  body.materials = {material};
  body.masses_kg.assign(body.nodes.size(), 0);
  constexpr std::array<std::array<int, 3>, 6> kOrders{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  const double share_kg = density_kg_m3 * kSpacingM * kSpacingM * kSpacingM / 24;
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i)
        for (std::size_t o = 0; o < 6; ++o) {
          std::array<int, 3> at{i, j, k};
          Tetrahedron t;
          for (std::size_t n = 0; n < 4; ++n) {
            if (n > 0) ++at[static_cast<std::size_t>(kOrders[o][n - 1])];
            t.nodes[n] = static_cast<std::uint32_t>(at[0] + nx * (at[1] + ny * at[2]));
            body.masses_kg[t.nodes[n]] += share_kg;
          }
          if (o == 1 || o == 2 || o == 5) std::swap(t.nodes[2], t.nodes[3]);  // odd orders are left-handed
          body.tetrahedra.push_back(t);
        }
  return body;
}

/// The same box of hexahedra, one per cell.
inline LumpedBody hexa_box(int nx, int ny, int nz, const SolidMaterial& material, double density_kg_m3 = 1000) {
  LumpedBody body = box_body(nx, ny, nz);
  body.elements.clear();
  body.materials = {material};
  body.masses_kg.assign(body.nodes.size(), 0);
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i) {
        Hexahedron& h = body.hexahedra.emplace_back();
        for (int n = 0; n < 8; ++n) {
          const int node = i + (n & 1) + nx * (j + (n >> 1 & 1) + ny * (k + (n >> 2 & 1)));
          h.nodes[static_cast<std::size_t>(n)] = static_cast<std::uint32_t>(node);
          body.masses_kg[h.nodes[static_cast<std::size_t>(n)]] += density_kg_m3 * kSpacingM * kSpacingM * kSpacingM / 8;
        }
      }
  return body;
}

inline Vec3 random_vector(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}

/// Random state: every free node is displaced by up to `shift_m` and moves at up to `speed_m_s` along every axis (in a planar
/// body: in its plane).
inline BodyState random_state(const Dynamics& dynamics, std::uint64_t seed, double shift_m, double speed_m_s) {
  Random random(seed);
  BodyState s = dynamics.rest_state();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i) {
    Vec3 shift = random_vector(random, shift_m), speed = random_vector(random, speed_m_s);
    if (dynamics.body().fixed[i]) continue;
    if (dynamics.body().planar) shift.z() = speed.z() = 0;
    s.x.segment<3>(3 * static_cast<Eigen::Index>(i)) += shift;
    s.v.segment<3>(3 * static_cast<Eigen::Index>(i)) += speed;
  }
  return s;
}

inline Vec3 node_of(const Vector& y, std::uint32_t i) { return y.segment<3>(3 * static_cast<Eigen::Index>(i)); }

/// A linear operator as a dense matrix, column by column.
template <class Multiply>
Matrix dense(Eigen::Index n, const Multiply& multiply) {
  Matrix a(n, n);
  for (Eigen::Index c = 0; c < n; ++c) a.col(c) = multiply(Vector(Vector::Unit(n, c)));
  return a;
}
inline Matrix dense_stiffness(const Dynamics& dynamics, const BodyState& s) {
  Vector k, d;
  return dense(s.x.size(), [&](const Vector& y) { return dynamics.multiply_tangents(s, y, k, d), k; });
}
inline Matrix dense_damping(const Dynamics& dynamics, const BodyState& s) {
  Vector k, d;
  return dense(s.x.size(), [&](const Vector& y) { return dynamics.multiply_tangents(s, y, k, d), d; });
}

/// A box of 4 x 4 x 4 nodes; a grasp holds one of its top.
inline Scene box_scene(ContactKind contact) {
  Scene scene;
  scene.name = "box";
  scene.body = box_body(4, 4, 4);
  scene.tool.contact = contact;
  scene.tool.node = 54;
  return scene;
}

}  // namespace palpate::test
