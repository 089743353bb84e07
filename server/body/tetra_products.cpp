// Products of many columns with the tangents of tetrahedra, four columns side by side.
#include "server/body/tetrahedra.hpp"

namespace palpate {
namespace {

/// A 3x3 matrix for each column.
struct Mat {
  ColumnLanes of[3][3];
};

/// sum over the nodes of y_i b_i^T
[[gnu::always_inline]] inline void gradient(const NodeLanes* const (&y)[4], const Mat34& b, Mat& f) {
  f = {};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) {
      f.of[0][c] += b(c, i) * lanes(y[i]->x);
      f.of[1][c] += b(c, i) * lanes(y[i]->y);
      f.of[2][c] += b(c, i) * lanes(y[i]->z);
    }
}

/// TetraTangent::apply
[[gnu::always_inline]] inline void elastic(const TetraTangent& at, const Mat& df, Mat& dp) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) dp.of[r][c] = at.a() * df.of[r][c];
  for (std::size_t k = 0; k < at.terms(); ++k) {
    const Mat3& q = at.q(k);
    ColumnLanes along{};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) along += q(r, c) * df.of[r][c];
    along *= at.c(k);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) dp.of[r][c] += q(r, c) * along;
  }
  if (at.kappa() == 0) return;
  const Mat3& f = at.f();
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      const int p = (c + 1) % 3, q = (c + 2) % 3, s = (r + 1) % 3, t = (r + 2) % 3;
      dp.of[r][c] += at.kappa() * (df.of[s][p] * f(t, q) - df.of[t][p] * f(s, q) + f(s, p) * df.of[t][q] - f(t, p) * df.of[s][q]);
    }
}

/// viscous_stress
[[gnu::always_inline]] inline void viscous(const TetraMaterial& m, const Mat3& f, const Mat& rate, Mat& p) {
  Mat c;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) c.of[r][s] = f(0, r) * rate.of[0][s] + f(1, r) * rate.of[1][s] + f(2, r) * rate.of[2][s];
  const ColumnLanes volume = m.viscous_lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2]);
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      p.of[r][s] = f(r, s) * volume;
      for (int k = 0; k < 3; ++k) p.of[r][s] += (m.viscous_mu * f(r, k)) * (c.of[k][s] + c.of[s][k]);
    }
}

/// V P b_i on each node.
[[gnu::always_inline]] inline void scatter(const TetraRest& rest, const Mat& p, NodeLanes* const (&to)[4]) {
  for (int i = 0; i < 4; ++i) {
    const Vec3 b = rest.volume_m3 * rest.b.col(i);
    lanes(to[i]->x) += b[0] * p.of[0][0] + b[1] * p.of[0][1] + b[2] * p.of[0][2];
    lanes(to[i]->y) += b[0] * p.of[1][0] + b[1] * p.of[1][1] + b[2] * p.of[1][2];
    lanes(to[i]->z) += b[0] * p.of[2][0] + b[1] * p.of[2][1] + b[2] * p.of[2][2];
  }
}

}  // namespace

void Tetrahedra::add_products(const std::vector<TetraTangent>& at, const std::vector<NodeLanes>& y, std::vector<NodeLanes>& k_y,
                              std::vector<NodeLanes>& d_y) const {
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const Cell& cell = cells_[k];
    const TetraMaterial& m = materials_[cell.material];
    const auto& n = cell.nodes;
    const NodeLanes* const of[4] = {&y[n[0]], &y[n[1]], &y[n[2]], &y[n[3]]};
    NodeLanes* const to_k[4] = {&k_y[n[0]], &k_y[n[1]], &k_y[n[2]], &k_y[n[3]]};
    NodeLanes* const to_d[4] = {&d_y[n[0]], &d_y[n[1]], &d_y[n[2]], &d_y[n[3]]};
    Mat change, p;
    gradient(of, cell.rest.b, change);
    elastic(at[k], change, p);
    scatter(cell.rest, p, to_k);
    if (m.viscous_mu == 0 && m.viscous_lambda == 0) continue;
    viscous(m, at[k].f(), change, p);
    scatter(cell.rest, p, to_d);
  }
  if (empty() || body_->mass_damping_1_s == 0) return;
  for (std::size_t i = 0; i < body_->nodes.size(); ++i) {
    const double c = body_->mass_damping_1_s * body_->masses_kg[i];
    lanes(d_y[i].x) += c * lanes(y[i].x);
    lanes(d_y[i].y) += c * lanes(y[i].y);
    lanes(d_y[i].z) += c * lanes(y[i].z);
  }
}

}  // namespace palpate
