// The laws of tetra_kernel.hpp, stresses and tangents, for elements with one deformation gradient F each, one per lane of a
// vector (doubles.hpp). Nothing is contracted: the bits are the same at every width.
#pragma once

#include "common/port/fibre_lanes.hpp"
#include "common/port/ogden.hpp"
#include "common/port/polar_lanes.hpp"
#include "server/body/tetra_kernel.hpp"

namespace palpate {

template <std::size_t N>
PALPATE_INLINE void add_neo_hookean(const TetraMaterial& m, const Mat<N>& f, Mat<N>& p) {
  Mat<N> g;
  cofactors(f, g);
  Doubles<N> i, j;
  inner(f, f, i);
  determinant(f, g, j);
  const Doubles<N> a = m.mu * (1.0 - 1.0 / (i + 1.0)), c = m.lambda * (j - m.alpha);
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) p.of[r][s] += a * f.of[r][s] + c * g.of[r][s];
}

template <std::size_t N>
PALPATE_INLINE void add_corotational(const TetraMaterial& m, const Mat<N>& f, Mat<N>& p) {
  Mat<N> r;
  polar_rotations(f, r);
  Doubles<N> trace;
  inner(r, f, trace);
  const Doubles<N> c = m.lambda * (trace - 3.0);
  for (int k = 0; k < 3; ++k)
    for (int s = 0; s < 3; ++s) p.of[k][s] += 2 * m.mu * (f.of[k][s] - r.of[k][s]) + c * r.of[k][s];
}

template <std::size_t N>
PALPATE_INLINE void add_membrane(const TetraMaterial& m, const Mat<N>& f, Mat<N>& p) {
  Mat<N> c;
  right_cauchy_green(f, c);
  const Doubles<N> by_f = 0.5 * m.lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2] - 2.0) - m.mu;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      p.of[r][s] += by_f * f.of[r][s] + m.mu * (f.of[r][0] * c.of[0][s] + f.of[r][1] * c.of[1][s] + f.of[r][2] * c.of[2][s]);
}

/// The quantities at one F that laws of both invariants need.
template <std::size_t N>
struct Invariants {
  Mat<N> g;
  Doubles<N> j, square;      ///< J, |F|^2
  Doubles<N> growth, slope;  ///< e and its derivative by I_1
};

template <std::size_t N>
PALPATE_INLINE void find_invariants(const TetraMaterial& m, const Mat<N>& f, Invariants<N>& at) {
  cofactors(f, at.g);
  determinant(f, at.g, at.j);
  inner(f, f, at.square);
  at.growth = at.square * 0.0 + 1.0;
  at.slope = Doubles<N>{};
  if (m.exponent == 0) return;
  const Doubles<N> y = m.exponent * (at.square - 1.0 - 2.0 * at.j);
  for (std::size_t l = 0; l < N; ++l) {
    at.growth[l] = growth(y[l]);
    at.slope[l] = m.exponent * growth_slope(y[l]);
  }
}

template <std::size_t N>
PALPATE_INLINE void square_of(const Mat<N>& f, Mat<N>& square) {
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) square.of[r][s] = f.of[r][0] * f.of[s][0] + f.of[r][1] * f.of[s][1] + f.of[r][2] * f.of[s][2];
}

/// Adds P of a law of both invariants; X(F)[G] = |F|^2 F - F F^T F.
template <std::size_t N>
PALPATE_INLINE void add_of_invariants(const TetraMaterial& m, const Mat<N>& f, Mat<N>& p) {
  Invariants<N> at;
  find_invariants(m, f, at);
  Mat<N> square;
  square_of(f, square);
  const Doubles<N> first = m.mu * at.growth, by_f = first + m.mu_2 * at.square;
  const Doubles<N> by_g = m.lambda * (at.j - 1.0) - first - 2 * m.mu_2;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s)
      p.of[r][s] += by_f * f.of[r][s] + by_g * at.g.of[r][s] -
                    m.mu_2 * (square.of[r][0] * f.of[0][s] + square.of[r][1] * f.of[1][s] + square.of[r][2] * f.of[2][s]);
}

/// Adds F (mu_v (C + C^T) + lambda_v tr(C) I), C = F^T F', in the precision of the matrices.
template <typename Matrix, typename Number>
PALPATE_INLINE void add_viscous(Number mu, Number lambda, const Matrix& f, const Matrix& rate, Matrix& p) {
  using Lanes = typename Matrix::Lanes;
  Matrix c;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) c.of[r][s] = f.of[0][r] * rate.of[0][s] + f.of[1][r] * rate.of[1][s] + f.of[2][r] * rate.of[2][s];
  const Lanes volume = lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2]);
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      Lanes sum = f.of[r][s] * volume;
      for (int k = 0; k < 3; ++k) sum += f.of[r][k] * (mu * (c.of[k][s] + c.of[s][k]));
      p.of[r][s] += sum;
    }
}

/// Adds P_elastic.
template <std::size_t N>
PALPATE_INLINE void add_elastic(const TetraMaterial& m, const Mat<N>& f, Mat<N>& p) {
  if (m.law == SolidLaw::neo_hookean)
    add_neo_hookean(m, f, p);
  else if (is_of_invariants(m.law))
    add_of_invariants(m, f, p);
  else if (m.law == SolidLaw::ogden)
    add_ogden<N>(m.ogden, Doubles<N>{} + m.mu, Doubles<N>{} + m.lambda, f, p);
  else if (m.law == SolidLaw::membrane)
    add_membrane(m, f, p);
  else
    add_corotational(m, f, p);
  if (m.fibre_k != 0) add_fibres<N>(m.fibres, Doubles<N>{} + m.fibre_k, f, p);
}

/// The quantities that all blocks between two nodes share.
template <std::size_t N, int Nodes>
struct Linearised {
  Doubles<N> a, kappa, along, spread, across,
      viscous_volume;  ///< a, kappa, 2 mu / (I + 1)^2 or 0, lambda; mu_v, lambda_v times c_d / c_k
  Doubles<N> stretch;  ///< for laws of both invariants: 2 mu_1 times the slope of e
  double second = 0;   ///< for laws of both invariants: mu_2 c_k
  Doubles<N> volume;
  Mat<N> square;                          ///< F F^T
  Doubles<N> fb[Nodes][3], gb[Nodes][3];  ///< F b_i, G b_i; corotational: R b_i
  Doubles<N> b[Nodes][3];
  Mat<N> f, g;
  Mat<N> turn[Nodes];  ///< corotational: kappa W [R b_i]x, W of inverse_pair_sums; both invariants: F [b_i]x
  Truths<N> good;      ///< true for lanes that are not cut
  // ogden and membrane: c_k, Q_k b_i and M b_i of TetraTangent
  Doubles<N> c[6], qb[6][Nodes][3], mb[Nodes][3];
  // Fibres: F a, S, 2 S', a . b_i
  bool has_fibres = false;
  FibrePull<N> fibres;
  Doubles<N> ab[Nodes];
};

/// Works lane by lane, except on nodal quantities.
template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_ogden(const TetraMaterial& m, const Doubles<N>& volume, double c_k, Linearised<N, Nodes>& at) {
  alignas(64) double kappa[N], c[6][N], q[6][9][N], g_of_c[9][N];
  for (std::size_t l = 0; l < N; ++l) {
    Mat3 f;
    for (int i = 0; i < 9; ++i) f(i / 3, i % 3) = at.f.of[i / 3][i % 3][l];
    const OgdenTangent of = ogden_tangent(m.ogden, {m.mu, m.lambda}, f);
    kappa[l] = of.kappa;
    for (std::size_t k = 0; k < 6; ++k) {
      c[k][l] = of.c[k];
      for (int i = 0; i < 9; ++i) q[k][i][l] = of.q[k](i / 3, i % 3);
    }
    for (int i = 0; i < 9; ++i) g_of_c[i][l] = of.g_of_c(i / 3, i % 3);
  }
  const Doubles<N> much = c_k * volume;
  cofactors(at.f, at.g);
  at.a = at.along = Doubles<N>{};
  at.kappa = much * doubles<N>(kappa);
  at.good = volume > 0.0;
  for (int k = 0; k < 6; ++k) at.c[k] = much * doubles<N>(c[k]);
  for (int n = 0; n < Nodes; ++n)
    for (int r = 0; r < 3; ++r) {
      for (int k = 0; k < 6; ++k)
        at.qb[k][n][r] = doubles<N>(q[k][3 * r]) * at.b[n][0] + doubles<N>(q[k][3 * r + 1]) * at.b[n][1] +
                         doubles<N>(q[k][3 * r + 2]) * at.b[n][2];
      at.mb[n][r] = much * (doubles<N>(g_of_c[3 * r]) * at.b[n][0] + doubles<N>(g_of_c[3 * r + 1]) * at.b[n][1] +
                            doubles<N>(g_of_c[3 * r + 2]) * at.b[n][2]);
    }
}

/// Uses modes along the axes of the rest shape.
template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_membrane(const TetraMaterial& m, const Doubles<N>& volume, double c_k, Linearised<N, Nodes>& at) {
  Mat<N> c;
  right_cauchy_green(at.f, c);
  const Doubles<N> much = c_k * volume, by_b = 0.5 * m.lambda * (c.of[0][0] + c.of[1][1] + c.of[2][2] - 2.0) - m.mu;
  at.g = {};
  at.a = at.kappa = Doubles<N>{};
  at.along = much * m.lambda;
  at.good = volume > 0.0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    at.c[k] = 2.0 * m.mu * much;
    at.c[k + 3] = m.mu * much;
    for (int n = 0; n < Nodes; ++n) {
      for (int r = 0; r < 3; ++r) {
        at.qb[k][n][r] = at.f.of[r][k] * at.b[n][k];
        at.qb[k + 3][n][r] = at.f.of[r][i] * at.b[n][j] + at.f.of[r][j] * at.b[n][i];
      }
      at.mb[n][k] =
          much * (by_b * at.b[n][k] + m.mu * (c.of[k][0] * at.b[n][0] + c.of[k][1] * at.b[n][1] + c.of[k][2] * at.b[n][2]));
    }
  }
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_fibres(const TetraMaterial& m, const Doubles<N>& volume, double c_k, Linearised<N, Nodes>& at) {
  at.has_fibres = m.fibre_k != 0;
  if (!at.has_fibres) return;
  find_fibres<N>(m.fibres, c_k * m.fibre_k * volume, at.f, at.fibres);
  at.fibres.slope *= 2.0;
  const auto& a = m.fibres.direction;
  for (int n = 0; n < Nodes; ++n) at.ab[n] = a[0] * at.b[n][0] + a[1] * at.b[n][1] + a[2] * at.b[n][2];
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void add_block_of_modes(const Linearised<N, Nodes>& at, int i, int j, Mat<N>& k) {
  const Doubles<N> both = at.b[i][0] * at.mb[j][0] + at.b[i][1] * at.mb[j][1] + at.b[i][2] * at.mb[j][2];
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      for (int t = 0; t < 6; ++t) k.of[r][s] += at.c[t] * at.qb[t][i][r] * at.qb[t][j][s];
      if (r == s) k.of[r][s] += both;
    }
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void add_fibre_block(const Linearised<N, Nodes>& at, int i, int j, Mat<N>& k) {
  const Doubles<N> both = at.ab[i] * at.ab[j], *const e = at.fibres.along;
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      k.of[r][s] += both * at.fibres.slope * e[r] * e[s];
      if (r == s) k.of[r][s] += both * at.fibres.pull;
    }
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_neo_hookean(const TetraMaterial& m, const Doubles<N>& volume, double c_k,
                                          Linearised<N, Nodes>& at) {
  cofactors(at.f, at.g);
  Doubles<N> i, j;
  inner(at.f, at.f, i);
  determinant(at.f, at.g, j);
  i += 1.0;
  at.a = c_k * m.mu * (1.0 - 1.0 / i) * volume;
  at.along = c_k * 2 * m.mu / (i * i) * volume;
  at.kappa = c_k * m.lambda * (j - m.alpha) * volume;
  at.good = i > 0.0;
}

/// Computes W = ((tr S) I - S)^-1 of the symmetric S = F R^T: for a change dF, R rotates about W t, with t the axial part of dF
/// R^T. `apart`: true where every two principal stretches add up to at least kLeastPairSum.
template <std::size_t N>
PALPATE_INLINE void inverse_pair_sums(const Mat<N>& f, const Mat<N>& r, Mat<N>& w, Truths<N>& apart) {
  Mat<N> s, h, g;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) s.of[i][j] = f.of[i][0] * r.of[j][0] + f.of[i][1] * r.of[j][1] + f.of[i][2] * r.of[j][2];
  pair_sums(s, h);
  cofactors(h, g);
  Doubles<N> det;
  determinant(h, g, det);
  for (int k = 0; k < 9; ++k) w.of[k / 3][k % 3] = g.of[k / 3][k % 3] / det;
  for (int k = 0; k < 3; ++k) h.of[k][k] -= kLeastPairSum;
  cofactors(h, g);
  determinant(h, g, det);
  apart = (h.of[0][0] > 0.0) & (g.of[2][2] > 0.0) & (det > 0.0);  // leading minors
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_corotational(const TetraMaterial& m, const Doubles<N>& volume, double c_k, Linearised<N, Nodes>& at,
                                           Mat<N>& w) {
  polar_rotations(at.f, at.g);
  Doubles<N> trace;
  inner(at.g, at.f, trace);
  at.a = Doubles<N>{} + c_k * 2 * m.mu * volume;
  at.along = Doubles<N>{};
  at.kappa = c_k * (m.lambda * (trace - 3.0) - 2 * m.mu) * volume;
  inverse_pair_sums(at.f, at.g, w, at.good);
}

template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise_of_invariants(const TetraMaterial& m, const Doubles<N>& volume, double c_k,
                                            Linearised<N, Nodes>& at) {
  Invariants<N> here;
  find_invariants(m, at.f, here);
  at.g = here.g;
  const Doubles<N> first = m.mu * here.growth;
  at.a = c_k * first * volume;
  at.along = Doubles<N>{};
  at.kappa = c_k * (m.lambda * (here.j - 1.0) - first - 2 * m.mu_2) * volume;
  at.stretch = c_k * 2 * m.mu * here.slope * volume;
  at.second = c_k * m.mu_2;
  at.good = here.square >= 0.0;
  for (int k = 0; k < Nodes; ++k)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const int p = (c + 1) % 3, q = (c + 2) % 3;
        at.turn[k].of[r][c] = at.f.of[r][p] * at.b[k][q] - at.f.of[r][q] * at.b[k][p];
      }
}

/// Requires `at.f` and `at.b`.
template <std::size_t N, int Nodes>
PALPATE_INLINE void linearise(const TetraMaterial& m, const Doubles<N>& volume, double c_d, double c_k,
                              Linearised<N, Nodes>& at) {
  Mat<N> w;
  if (m.law == SolidLaw::neo_hookean)
    linearise_neo_hookean(m, volume, c_k, at);
  else if (is_of_invariants(m.law))
    linearise_of_invariants(m, volume, c_k, at);
  else if (m.law == SolidLaw::ogden)
    linearise_ogden(m, volume, c_k, at);
  else if (m.law == SolidLaw::membrane)
    linearise_membrane(m, volume, c_k, at);
  else
    linearise_corotational(m, volume, c_k, at, w);
  linearise_fibres(m, volume, c_k, at);
  at.spread = c_k * m.lambda * volume;
  at.across = c_d * m.viscous_mu * volume;
  at.viscous_volume = c_d * m.viscous_lambda * volume;
  square_of(at.f, at.square);
  for (int k = 0; k < Nodes; ++k)
    for (int r = 0; r < 3; ++r) {
      at.fb[k][r] = at.f.of[r][0] * at.b[k][0] + at.f.of[r][1] * at.b[k][1] + at.f.of[r][2] * at.b[k][2];
      at.gb[k][r] = at.g.of[r][0] * at.b[k][0] + at.g.of[r][1] * at.b[k][1] + at.g.of[r][2] * at.b[k][2];
    }
  at.volume = volume;
  if (m.law != SolidLaw::corotational) return;
  for (int k = 0; k < Nodes; ++k)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const int p = (c + 1) % 3, q = (c + 2) % 3;
        at.turn[k].of[r][c] = at.kappa * (w.of[r][p] * at.gb[k][q] - w.of[r][q] * at.gb[k][p]);
      }
}

/// Adds the mixed second derivative of det F, much X(A), with A = F or G.
template <std::size_t N, int Nodes>
PALPATE_INLINE void add_mixed(const Linearised<N, Nodes>& at, const Doubles<N>& much, const Mat<N>& a, int i, int j, Mat<N>& k) {
  const Doubles<N>*bi = at.b[i], *bj = at.b[j];
  Doubles<N> normal[3], w[3];
  for (int c = 0; c < 3; ++c) normal[c] = bi[(c + 1) % 3] * bj[(c + 2) % 3] - bi[(c + 2) % 3] * bj[(c + 1) % 3];
  for (int r = 0; r < 3; ++r) w[r] = much * (a.of[r][0] * normal[0] + a.of[r][1] * normal[1] + a.of[r][2] * normal[2]);
  for (int r = 0; r < 3; ++r) {
    k.of[r][(r + 1) % 3] += w[(r + 2) % 3];
    k.of[r][(r + 2) % 3] -= w[(r + 1) % 3];
  }
}

/// Adds the term from the rotation of R: -kappa [R b_i]x W [R b_j]x.
template <std::size_t N, int Nodes>
PALPATE_INLINE void add_turning(const Linearised<N, Nodes>& at, int i, int j, Mat<N>& k) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const int p = (r + 1) % 3, q = (r + 2) % 3;
      k.of[r][c] += at.gb[i][q] * at.turn[j].of[p][c] - at.gb[i][p] * at.turn[j].of[q][c];
    }
}

/// Adds the terms of laws of both invariants: the change of e, and X(G) + X(F) X(F).
template <std::size_t N, int Nodes>
PALPATE_INLINE void add_invariant_block(const Linearised<N, Nodes>& at, int i, int j, Mat<N>& k) {
  Doubles<N> both;
  inner(at.turn[i], at.turn[j], both);
  const Doubles<N> second = at.second * at.volume;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      Doubles<N> sum = at.turn[j].of[r][0] * at.turn[i].of[c][0];
      for (int n = 1; n < 3; ++n) sum += at.turn[j].of[r][n] * at.turn[i].of[c][n];
      k.of[r][c] += at.stretch * (at.fb[i][r] - at.gb[i][r]) * (at.fb[j][c] - at.gb[j][c]) - second * sum;
      if (r == c) k.of[r][c] += second * both;
    }
  if (i != j) add_mixed(at, second, at.g, i, j, k);
}

/// Computes TetraTangent::block plus viscous_block (tetra_kernel.hpp) of nodes i and j.
template <std::size_t N, int Nodes>
PALPATE_INLINE void tangent_block(const Linearised<N, Nodes>& at, SolidLaw law, int i, int j, Mat<N>& k) {
  const Doubles<N>*bi = at.b[i], *bj = at.b[j];
  const Doubles<N> dot = bi[0] * bj[0] + bi[1] * bj[1] + bi[2] * bj[2];
  for (int r = 0; r < 3; ++r)
    for (int s = 0; s < 3; ++s) {
      k.of[r][s] = at.along * at.fb[i][r] * at.fb[j][s] + at.spread * at.gb[i][r] * at.gb[j][s] +
                   at.across * (dot * at.square.of[r][s] + at.fb[j][r] * at.fb[i][s]) +
                   at.viscous_volume * at.fb[i][r] * at.fb[j][s];
      if (r == s) k.of[r][s] += at.a * dot;
    }
  if (law == SolidLaw::corotational)
    add_turning(at, i, j, k);
  else if (i != j)
    add_mixed(at, at.kappa, at.f, i, j, k);
  if (is_of_invariants(law)) add_invariant_block(at, i, j, k);
  if (law == SolidLaw::ogden || law == SolidLaw::membrane) add_block_of_modes(at, i, j, k);
  if (at.has_fibres) add_fibre_block(at, i, j, k);
}

}  // namespace palpate
