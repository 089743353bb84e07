// The tangents of tetra_kernel.hpp applied to changes of F, four columns side by side.
#pragma once

#include "server/body/column_lanes.hpp"
#include "server/body/fused.hpp"
#include "server/body/tetra_kernel.hpp"

namespace palpate {

/// A 3x3 matrix for each column.
struct ColumnMat {
  ColumnLanes of[3][3];
};

/// Computes to += much X(A)[dF].
[[gnu::always_inline]] inline void add_mixed_columns(double much, const Mat3& a, const ColumnMat& df, ColumnMat& to) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) {
      const int p = (c + 1) % 3, q = (c + 2) % 3, s = (r + 1) % 3, t = (r + 2) % 3;
      to.of[r][c] += much * (df.of[s][p] * a(t, q) - df.of[t][p] * a(s, q) + a(s, p) * df.of[t][q] - a(t, p) * df.of[s][q]);
    }
}

/// Computes dP as TetraTangent::apply does.
[[gnu::always_inline]] inline void apply_elastic(const TetraTangent& at, const ColumnMat& df, ColumnMat& dp) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) dp.of[r][c] = at.a() * df.of[r][c];
  if (at.has_m())
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        for (int k = 0; k < 3; ++k) add_product(at.m()(k, c), df.of[r][k], dp.of[r][c]);
  for (std::size_t k = 0; k < at.terms(); ++k) {
    const Mat3& q = at.q(k);
    ColumnLanes along{};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) add_product(q(r, c), df.of[r][c], along);
    along *= at.c(k);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) add_product(q(r, c), along, dp.of[r][c]);
  }
  if (at.kappa() != 0) add_mixed_columns(at.kappa(), at.f(), df, dp);
  if (at.mu_2() == 0) return;
  add_mixed_columns(at.mu_2(), at.g(), df, dp);
  ColumnMat change{};
  add_mixed_columns(1, at.f(), df, change);
  add_mixed_columns(at.mu_2(), at.f(), change, dp);
}

/// Computes p += much viscous_stress.
[[gnu::always_inline]] inline void add_viscous_columns(const TetraMaterial& m, double much, const Mat3& f, const ColumnMat& rate,
                                                       ColumnMat& p) {
  ColumnMat c;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      c.of[r][s] = f(0, r) * rate.of[0][s];
      add_product(f(1, r), rate.of[1][s], c.of[r][s]), add_product(f(2, r), rate.of[2][s], c.of[r][s]);
    }
  const ColumnLanes volume = m.viscous_lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2]);
  ColumnMat second;  // Piola-Kirchhoff
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) second.of[r][s] = m.viscous_mu * (c.of[r][s] + c.of[s][r]);
  for (int r = 0; r < 3; ++r) second.of[r][r] += volume;
  const Mat3 turned = much * f;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      for (int k = 0; k < 3; ++k) add_product(turned(r, k), second.of[k][s], p.of[r][s]);
}

}  // namespace palpate
