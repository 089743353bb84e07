#include "tests/support/patches.hpp"

#include <cmath>

namespace palpate::test {

namespace {

/// Between -1 and 1, the same everywhere, without a pattern that modes or axes share.
double spread(int i, int j) { return std::sin(12.9898 * i + 78.233 * j + 0.5); }

Patch at_rest(int modes, std::uint32_t seq, Micros stamp) {
  Patch patch;
  patch.seq = seq;
  patch.stamp = stamp;
  patch.scheme = Scheme::port;
  patch.stiffness.resize(modes);
  patch.damping = ModeMatrix::Zero(modes, modes);
  patch.g = patch.q_rate = ModeVector::Zero(modes);
  for (int i = 0; i < modes; ++i) {
    const double omega = 2 * M_PI * 5 * (1 + 0.7 * i);
    patch.stiffness[i] = omega * omega;
    patch.damping(i, i) = 0.2 * omega;
  }
  patch.trust_radius_m = 0.1;
  patch.valid_for = Micros{2'000'000};
  return patch;
}

}  // namespace

Patch attach_patch(int modes, std::uint32_t seq, Micros stamp) {
  Patch patch = at_rest(modes, seq, stamp);
  patch.contact = ContactKind::attach;
  patch.b_k.resize(modes, 3);
  patch.b_d.resize(modes, 3);
  for (int i = 0; i < modes; ++i)
    for (int j = 0; j < 3; ++j) {
      // As of a lumped node on springs to modes of about 50 g.
      patch.b_k(i, j) = patch.stiffness[i] * 0.05 * spread(i, j);
      patch.b_d(i, j) = patch.damping(i, i) * 0.05 * spread(i, j);
    }
  const ModeVector softness = patch.stiffness.cwiseInverse(), ease = patch.damping.diagonal().cwiseInverse();
  patch.k_port = patch.b_k.transpose() * softness.asDiagonal() * patch.b_k + 50 * Mat3::Identity();
  patch.d_port = patch.b_d.transpose() * ease.asDiagonal() * patch.b_d + 0.2 * Mat3::Identity();
  return patch;
}

Patch touch_patch(int modes, std::uint32_t seq, Micros stamp) {
  Patch patch = at_rest(modes, seq, stamp);
  patch.contact = ContactKind::touch;
  patch.coupling_n_m = 1000;
  patch.friction = 0.3;
  patch.c_static = 1e-4 * Mat3::Identity();
  PortSurface& surface = patch.surface;
  surface.vertex_count = 9;
  surface.triangle_count = 8;
  for (int i = 0; i < 9; ++i) {
    PortVertex& vertex = surface.vertices[static_cast<std::size_t>(i)];
    vertex.position = Vec3(0.02 * (i % 3 - 1), 0.02 * (i / 3 - 1), 0);
    vertex.rows.resize(3, modes);
    for (int mode = 0; mode < modes; ++mode)
      for (int axis = 0; axis < 3; ++axis) vertex.rows(axis, mode) = 2 * spread(mode, axis) + 0.2 * spread(mode + 20, axis + i);
  }
  for (std::uint32_t cell = 0; cell < 4; ++cell) {
    const std::uint32_t corner = cell % 2 + 3 * (cell / 2);
    surface.triangles[2 * cell] = {corner, corner + 1, corner + 4};
    surface.triangles[2 * cell + 1] = {corner, corner + 4, corner + 3};
  }
  return patch;
}

}  // namespace palpate::test
