#include "tests/support/patches.hpp"

#include <algorithm>
#include <cmath>

#include "common/patch/terms_pieces.hpp"

namespace palpate::test {

namespace {

/// Pseudo-random number in [-1, 1], deterministic, without a pattern common to modes or axes.
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
      // Like a lumped node on springs to modes of about 50 g.
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
  patch.contact_stiffness_n_m = 1000;
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

namespace {

Eigen::MatrixXf some(int rows, int cols, double size) {
  Eigen::MatrixXf m(rows, cols);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) m(i, j) = static_cast<float>(size * spread(i, j));
  return m;
}

}  // namespace

NonlinearTerms sampled_terms(const Patch& patch) {
  NonlinearTerms terms;
  terms.grasp = patch.contact == ContactKind::attach;
  terms.variables = patch.modes() + (terms.grasp ? 3 : 0);
  terms.rate = stamp_rate(patch);
  return terms;
}

namespace {

NonlinearTerms some_springs(const Patch& patch, int count, int nodes) {
  NonlinearTerms terms = sampled_terms(patch);
  SampledElements& springs = terms.elements;
  springs.stiffening = 30;
  springs.motion = rounded(some(3 * nodes, patch.modes(), 0.7), terms.grasp ? 4 : -1);
  springs.position = some(3, nodes, 0.02);
  springs.nodes.resize(2, count);
  for (int e = 0; e < count; ++e) springs.nodes.col(e) << e % nodes, (3 * e + 5 + e / nodes) % nodes;
  springs.rest_length = Eigen::VectorXf::Constant(count, 0.02F);
  springs.stiffness = Eigen::VectorXf::Constant(count, static_cast<float>(patch.stiffness.mean() / (3 * count)));
  springs.damping = 0.01F * springs.stiffness;
  springs.max_slope = SampledElements::steep_of(Eigen::ArrayXd::Constant(count, 10));
  return terms;
}

}  // namespace

NonlinearTerms spring_terms(const Patch& patch) { return some_springs(patch, 20, 13); }
NonlinearTerms slack_spring_terms(const Patch& patch) {
  NonlinearTerms terms = spring_terms(patch);
  SampledElements& springs = terms.elements;
  springs.stiffening = 0;
  springs.max_slope.clear();
  springs.stiffness *= 0.1F;
  springs.damping *= 0.1F;
  springs.rest_length = springs.spans().colwise().norm().transpose().cwiseMax(1e-3F);  // one has zero length
  return terms;
}
NonlinearTerms many_spring_terms(const Patch& patch) { return some_springs(patch, 60, 40); }

NonlinearTerms solid_terms(const Patch& patch) {
  constexpr int kCount = 20, kNodes = 13;
  NonlinearTerms terms = sampled_terms(patch);
  SampledElements& solid = terms.elements;
  solid.motion = rounded(some(3 * kNodes, patch.modes(), 0.7), terms.grasp ? 4 : -1);
  // Along a helix any four consecutive points span a volume of the same orientation.
  solid.rest.resize(3, kNodes);
  for (int i = 0; i < kNodes; ++i) {
    const auto k = static_cast<float>(i);
    solid.rest.col(i) << 0.02F * std::cos(1.2F * k), 0.02F * std::sin(1.2F * k), 0.008F * k;
  }
  solid.position = solid.rest + some(3, kNodes, 0.001);
  solid.nodes.resize(4, kCount);
  for (int e = 0; e < kCount; ++e)
    for (int i = 0; i < 4; ++i) solid.nodes(i, e) = e % (kNodes - 3) + i;
  // |dF| is about 30 / m for a displacement of 1 m in a mode of unit mass.
  solid.stiffness = Eigen::VectorXf::Constant(kCount, static_cast<float>(patch.stiffness.mean() / (1e4 * kCount)));
  solid.dilation = 4 * solid.stiffness;
  solid.damping = Eigen::VectorXf::Constant(kCount, 0.01F);
  return terms;
}

}  // namespace palpate::test
