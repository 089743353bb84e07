#include "server/body/tetra_kernel.hpp"

#include <Eigen/Dense>
#include <cassert>
#include <cmath>
#include <numbers>

#include "common/port/fibre_lanes.hpp"
#include "common/mechanics/polar.hpp"

namespace palpate {
namespace {

/// Returns the first-order change of the cofactors of A with B.
Mat3 mixed_cofactors(const Mat3& a, const Mat3& b) {
  Mat3 x;
  for (int k = 0; k < 3; ++k) {
    const int p = (k + 1) % 3, q = (k + 2) % 3;
    x.col(k) = a.col(p).cross(b.col(q)) + b.col(p).cross(a.col(q));
  }
  return x;
}

Mat3 cross_matrix(const Vec3& w) {
  Mat3 m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

double inner(const Mat3& a, const Mat3& b) { return a.cwiseProduct(b).sum(); }

Mat3 second_order_neo_hookean(const TetraMaterial& m, const Mat3& f, const Mat3& df_1, const Mat3& df_2) {
  const Mat3 g = cofactors(f), x_1 = mixed_cofactors(f, df_1), x_2 = mixed_cofactors(f, df_2);
  const double s = f.squaredNorm() + 1, along_1 = inner(f, df_1), along_2 = inner(f, df_2);
  const Mat3 shear = (2 / (s * s)) * (along_2 * df_1 + along_1 * df_2 + (inner(df_1, df_2) - 4 * along_1 * along_2 / s) * f);
  const double pressure = f.col(0).dot(g.col(0)) - m.alpha;
  return m.mu * shear +
         m.lambda * (inner(x_2, df_1) * g + inner(g, df_1) * x_2 + inner(g, df_2) * x_1 + pressure * mixed_cofactors(df_1, df_2));
}

/// Returns I_1 of a law of both invariants.
double first_invariant(const Mat3& f, double j) { return f.squaredNorm() - 1 - 2 * j; }

Mat3 second_order_of_invariants(const TetraMaterial& m, const Mat3& f, const Mat3& df_1, const Mat3& df_2) {
  const Mat3 g = cofactors(f), x_1 = mixed_cofactors(f, df_1), x_2 = mixed_cofactors(f, df_2), both = mixed_cofactors(df_1, df_2),
             w = f - g, w_1 = df_1 - x_1, w_2 = df_2 - x_2;
  const double j = f.col(0).dot(g.col(0)), y = m.exponent * first_invariant(f, j), slope = m.exponent * growth_slope(y);
  const double i_1 = 2 * inner(w, df_1), i_2 = 2 * inner(w, df_2), i_12 = 2 * (inner(df_1, df_2) - inner(x_1, df_2));
  const double curvature = y < kLogGrowthMax ? m.exponent * slope : 0;
  const Mat3 first = (slope * i_12 + curvature * i_1 * i_2) * w + slope * (i_1 * w_2 + i_2 * w_1) - growth(y) * both;
  const Mat3 second = mixed_cofactors(df_1, x_2) + mixed_cofactors(df_2, x_1) + mixed_cofactors(f, both) - 2 * both;
  const Mat3 volume = inner(x_1, df_2) * g + inner(g, df_1) * x_2 + inner(g, df_2) * x_1 + (j - 1) * both;
  return m.mu * first + m.mu_2 * second + m.lambda * volume;
}

/// Uses dR = R O, O S + S O = R^T dF - dF^T R, and the derivative of that.
Mat3 second_order_corotational(const TetraMaterial& m, const Mat3& f, const Mat3& df_1, const Mat3& df_2) {
  const Mat3 r = polar_rotation(f), s = 0.5 * (r.transpose() * f + f.transpose() * r);
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(s);
  const Vec3 pairs = (s.trace() - eigen.eigenvalues().array()).max(kLeastPairSum);
  const Mat3 w = eigen.eigenvectors() * pairs.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  const auto solve = [&](const Mat3& skew) { return cross_matrix(w * Vec3(skew(2, 1), skew(0, 2), skew(1, 0))); };
  const auto skew = [](const Mat3& a) -> Mat3 { return a - a.transpose(); };
  const Mat3 turn_1 = solve(skew(r.transpose() * df_1)), turn_2 = solve(skew(r.transpose() * df_2));
  const Mat3 dr_1 = r * turn_1, dr_2 = r * turn_2, ds_2 = r.transpose() * df_2 - turn_2 * s;
  const Mat3 both = solve(skew(dr_2.transpose() * df_1) - turn_1 * ds_2 - ds_2 * turn_1);
  const Mat3 ddr = r * (turn_2 * turn_1 + both);
  return (m.lambda * (s.trace() - 3) - 2 * m.mu) * ddr +
         m.lambda * (inner(dr_2, df_1) * r + inner(r, df_1) * dr_2 + inner(r, df_2) * dr_1);
}

/// Returns the unit matrix of a rotation about principal axis k.
Mat3 twist(int k) { return cross_matrix(Vec3::Unit(k)) / std::numbers::sqrt2; }
Mat3 flip(int k) { return twist(k).cwiseAbs(); }

}  // namespace

TetraMaterial::TetraMaterial(const SolidMaterial& material) : law(material.law) {
  assert(material.young_pa > 0 && material.poisson > -1 && material.poisson < 0.5 && material.damping_s >= 0);
  const LameParameters lame = lame_parameters(law, material.young_pa, material.poisson);
  mu = lame.mu, lambda = lame.lambda;
  viscous_mu = material.damping_s * mu;
  viscous_lambda = material.damping_s * lambda;
  if (is_of_invariants(law)) {
    const InvariantModuli of = invariant_moduli(law, material.shape, mu, lambda);
    mu = of.mu_1, mu_2 = of.mu_2, lambda = of.lambda, exponent = of.exponent;
  }
  fibres = material.fibres;
  const auto& a = fibres.direction;
  assert(std::abs(a[0] * a[0] + a[1] * a[1] + a[2] * a[2] - 1) < 1e-6 && fibres.share >= 0);
  fibre_k = fibres.share * lame.mu;
  if (law == SolidLaw::ogden) {
    ogden = OgdenLaw(material.parameters());
    lambda += ogden.sum * mu;
  }
  if (law != SolidLaw::neo_hookean) return;
  lambda += 5.0 / 6 * mu;
  mu *= 4.0 / 3;
  alpha = 1 + 0.75 * mu / lambda;
}

TetraRest::TetraRest(const Mat34& rest) {
  const Mat3 edges = rest.rightCols<3>().colwise() - rest.col(0);
  if (rest.col(3) == rest.col(0)) {
    const Eigen::Matrix<double, 3, 2> sides = edges.leftCols<2>();
    b.col(3).setZero();
    b.middleCols<2>(1) = sides * (sides.transpose() * sides).inverse();
    b.col(0) = -(b.col(1) + b.col(2));
    volume_m3 = 0.5 * edges.col(0).cross(edges.col(1)).norm();
    return;
  }
  b.rightCols<3>() = edges.inverse().transpose();
  b.col(0) = -b.rightCols<3>().rowwise().sum();
  volume_m3 = edges.determinant() / 6;
}

namespace {

double energy_of_law(const TetraMaterial& m, const Mat3& f) {
  if (m.law == SolidLaw::membrane) {
    const Mat3 c = f.transpose() * f;
    const double trace = 0.5 * (c.trace() - 2);
    return 0.25 * m.mu * (c.squaredNorm() - 2 * c.trace() + 2) + 0.5 * m.lambda * trace * trace;
  }
  if (m.law == SolidLaw::ogden) return ogden_energy(m.ogden, {m.mu, m.lambda}, f);
  if (m.law == SolidLaw::corotational) {
    const Mat3 r = polar_rotation(f);
    const double trace = r.cwiseProduct(f).sum() - 3;
    return m.mu * (f - r).squaredNorm() + 0.5 * m.lambda * trace * trace;
  }
  if (is_of_invariants(m.law)) {
    const double j = f.determinant(), i = first_invariant(f, j), more = j - 1;
    const double first = m.exponent == 0 ? i : growth_integral(m.exponent * i) / m.exponent;
    return 0.5 * (m.mu * first + m.mu_2 * (cofactors(f).squaredNorm() - 3 - 4 * more) + m.lambda * more * more);
  }
  const double i = f.squaredNorm(), j = f.determinant() - m.alpha;
  return 0.5 * m.mu * (i - 3 - std::log((i + 1) / 4)) + 0.5 * m.lambda * (j * j - (1 - m.alpha) * (1 - m.alpha));
}

Mat3 stress_of_law(const TetraMaterial& m, const Mat3& f) {
  if (m.law == SolidLaw::membrane) return (0.5 * m.lambda * (f.squaredNorm() - 2) - m.mu) * f + m.mu * (f * (f.transpose() * f));
  if (m.law == SolidLaw::ogden) return ogden_stress(m.ogden, {m.mu, m.lambda}, f);
  if (m.law == SolidLaw::corotational) {
    const Mat3 r = polar_rotation(f);
    return 2 * m.mu * (f - r) + m.lambda * (r.cwiseProduct(f).sum() - 3) * r;
  }
  const Mat3 g = cofactors(f);
  const double j = f.col(0).dot(g.col(0));
  if (is_of_invariants(m.law))
    return m.mu * growth(m.exponent * first_invariant(f, j)) * (f - g) + m.mu_2 * (mixed_cofactors(f, g) - 2 * g) +
           m.lambda * (j - 1) * g;
  return m.mu * (1 - 1 / (f.squaredNorm() + 1)) * f + m.lambda * (j - m.alpha) * g;
}

}  // namespace

double elastic_energy_density(const TetraMaterial& m, const Mat3& f) {
  const double of_law = energy_of_law(m, f);
  if (m.fibre_k == 0) return of_law;
  return of_law + FibreStress(m.fibres, m.fibre_k, f).energy;
}

Mat3 elastic_stress(const TetraMaterial& m, const Mat3& f) {
  const Mat3 of_law = stress_of_law(m, f);
  if (m.fibre_k == 0) return of_law;
  return of_law + FibreStress(m.fibres, m.fibre_k, f).stress();
}

Mat3 viscous_stress(const TetraMaterial& m, const Mat3& f, const Mat3& f_rate) {
  const Mat3 product = f.transpose() * f_rate;
  Mat3 s = m.viscous_mu * (product + product.transpose());
  s.diagonal().array() += m.viscous_lambda * product.trace();
  return f * s;
}

Mat3 second_order_stress(const TetraMaterial& m, const Mat3& f, const Mat3& df_1, const Mat3& df_2) {
  if (m.law == SolidLaw::ogden || m.law == SolidLaw::membrane || m.fibre_k != 0) {
    constexpr double kChange = 2e-5;  // step of F
    const double size = df_2.norm();
    if (size == 0) return Mat3::Zero();
    const Mat3 way = (kChange / size) * df_2;
    return (TetraTangent(m, f + way, false).apply(df_1) - TetraTangent(m, f - way, false).apply(df_1)) * (size / (2 * kChange));
  }
  if (m.law == SolidLaw::corotational) return second_order_corotational(m, f, df_1, df_2);
  return is_of_invariants(m.law) ? second_order_of_invariants(m, f, df_1, df_2) : second_order_neo_hookean(m, f, df_1, df_2);
}

TetraTangent::TetraTangent(const TetraMaterial& material, const Mat3& f, bool clamp) : f_(f) {
  if (material.law == SolidLaw::corotational)
    corotational(material, clamp);
  else if (material.law == SolidLaw::membrane)
    of_membrane(material, clamp);
  else if (clamp)
    clamped(material);
  else if (is_of_invariants(material.law))
    of_invariants(material);
  else if (material.law == SolidLaw::ogden)
    of_ogden(material);
  else
    neo_hookean(material);
  if (material.fibre_k != 0) add_fibres(material, clamp);
}

/// A rotation of F by R [w]x rotates R by R [w / (s_i + s_j)]x: three modes, along the eigenvectors of S.
void TetraTangent::corotational(const TetraMaterial& m, bool clamp) {
  const Mat3 r = polar_rotation(f_);
  Mat3 s = r.transpose() * f_;
  s = 0.5 * (s + s.transpose()).eval();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(s);
  a_ = 2 * m.mu;
  add(m.lambda, r);
  for (int k = 0; k < 3; ++k) {
    const double pair_sum = std::max(s.trace() - eigen.eigenvalues()[k], kLeastPairSum);
    const double c = 2 * (m.lambda * (s.trace() - 3) - 2 * m.mu) / pair_sum;
    add(clamp ? std::max(c, -a_) : c, r * cross_matrix(eigen.eigenvectors().col(k)) / std::numbers::sqrt2);
  }
}

void TetraTangent::neo_hookean(const TetraMaterial& m) {
  const Mat3 g = cofactors(f_);
  const double i = f_.squaredNorm() + 1;
  a_ = m.mu * (1 - 1 / i);
  kappa_ = m.lambda * (f_.col(0).dot(g.col(0)) - m.alpha);
  add(2 * m.mu / (i * i), f_);
  add(m.lambda, g);
}

void TetraTangent::of_invariants(const TetraMaterial& m) {
  g_ = cofactors(f_);
  const double j = f_.col(0).dot(g_.col(0)), y = m.exponent * first_invariant(f_, j);
  a_ = m.mu * growth(y);
  mu_2_ = m.mu_2;
  kappa_ = m.lambda * (j - 1) - a_ - 2 * mu_2_;
  add(2 * m.mu * m.exponent * growth_slope(y), f_ - g_);
  add(m.lambda, g_);
}

void TetraTangent::of_ogden(const TetraMaterial& m) {
  const OgdenTangent at = ogden_tangent(m.ogden, {m.mu, m.lambda}, f_);
  add_m(at.g_of_c);
  for (std::size_t k = 0; k < at.c.size(); ++k) add(at.c[k], at.q[k]);
  kappa_ = at.kappa;
  add(m.lambda, cofactors(f_));
}

/// dE is half of F^T dF plus its transpose: modes along the axes of the rest shape.
void TetraTangent::of_membrane(const TetraMaterial& m, bool clamp) {
  Mat3 stress = m.mu * (f_.transpose() * f_);
  stress.diagonal().array() += 0.5 * m.lambda * (f_.squaredNorm() - 2) - m.mu;
  if (clamp) {  // under compression its stress makes it buckle sideways
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(stress);
    stress = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * eigen.eigenvectors().transpose();
  }
  add_m(stress);
  add(m.lambda, f_);
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    add(2 * m.mu, f_.col(k) * Vec3::Unit(k).transpose());
    add(m.mu, f_.col(i) * Vec3::Unit(j).transpose() + f_.col(j) * Vec3::Unit(i).transpose());
  }
}

void TetraTangent::add_fibres(const TetraMaterial& m, bool clamp) {
  const FibreStress at(m.fibres, m.fibre_k, f_);
  const double pull = clamp ? std::max(0.0, at.pull) : at.pull;
  add_m(pull * at.a * at.a.transpose());
  add(2 * at.slope, at.along * at.a.transpose());
}

/// Works in principal stretches, as any isotropic law is a function of them.
void TetraTangent::clamped(const TetraMaterial& m) {
  const SignedSvd svd = signed_svd(f_);
  const Vec3& s = svd.s;
  const Vec3 g(s.y() * s.z(), s.x() * s.z(), s.x() * s.y());
  const double j = s.x() * g.x();
  double a = 0, kappa = 0, along = 0;
  Vec3 way = s;
  OgdenPrincipal of{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  if (m.law == SolidLaw::ogden) {
    of = ogden_principal(m.ogden, m.mu, s.cwiseAbs2());
    kappa = m.lambda * (j - 1) - m.ogden.sum * m.mu;
  } else if (is_of_invariants(m.law)) {
    const double y = m.exponent * (s.squaredNorm() - 1 - 2 * j);
    a = m.mu * growth(y), kappa = m.lambda * (j - 1) - a - 2 * m.mu_2, along = 2 * m.mu * m.exponent * growth_slope(y);
    way -= g;
  } else {
    const double i = s.squaredNorm() + 1;
    a = m.mu * (1 - 1 / i), kappa = m.lambda * (j - m.alpha), along = 2 * m.mu / (i * i);
  }
  Mat3 scaling = along * way * way.transpose() + m.lambda * g * g.transpose();
  for (int k = 0; k < 3; ++k) {
    const int p = (k + 1) % 3, q = (k + 2) % 3;
    scaling(k, k) += a + m.mu_2 * (s[p] * s[p] + s[q] * s[q]) + of.g[k] + 2 * s[k] * s[k] * of.slope[k];
    const double across = kappa * s[k] + 2 * m.mu_2 * s[p] * s[q];
    scaling(p, q) += across;
    scaling(q, p) += across;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(scaling);
  const auto in_place = [&](const Mat3& q) -> Mat3 { return svd.u * q * svd.v.transpose(); };
  for (int k = 0; k < 3; ++k) {
    const double sp = s[(k + 1) % 3], sq = s[(k + 2) % 3];
    const double product = m.mu_2 * sp * sq - of.between[k] * sp * sq;
    const double both = a + m.mu_2 * s[k] * s[k] + of.g[(k + 2) % 3] + of.between[k] * sp * sp;
    add(std::max(0.0, both + (kappa * s[k] + product)), in_place(twist(k)));
    add(std::max(0.0, both - (kappa * s[k] + product)), in_place(flip(k)));
    add(std::max(0.0, eigen.eigenvalues()[k]), in_place(eigen.eigenvectors().col(k).asDiagonal()));
  }
}

Mat3 TetraTangent::apply(const Mat3& df) const {
  Mat3 dp = a_ * df;
  if (has_m_) dp += df * m_;
  for (std::size_t k = 0; k < terms_; ++k) dp += (c_[k] * q_[k].cwiseProduct(df).sum()) * q_[k];
  if (kappa_ != 0) dp += kappa_ * mixed_cofactors(f_, df);
  if (mu_2_ != 0) dp += mu_2_ * (mixed_cofactors(g_, df) + mixed_cofactors(f_, mixed_cofactors(f_, df)));
  return dp;
}

Mat3 TetraTangent::block(double volume_m3, const Vec3& bi, const Vec3& bj, bool same) const {
  Mat3 k = Mat3::Zero();
  k.diagonal().setConstant(a_ * bi.dot(bj) + (has_m_ ? bi.dot(m_ * bj) : 0));
  for (std::size_t t = 0; t < terms_; ++t) k += c_[t] * (q_[t] * bi) * (q_[t] * bj).transpose();
  // The mixed second derivative of det F for rank-one changes: (di x dj) . F (bi x bj).
  if (kappa_ != 0 && !same) k -= kappa_ * cross_matrix(f_ * bi.cross(bj));
  if (mu_2_ != 0) {
    const Mat3 of_i = f_ * cross_matrix(bi), of_j = f_ * cross_matrix(bj);
    k += mu_2_ * (inner(of_i, of_j) * Mat3::Identity() - of_j * of_i.transpose() - cross_matrix(g_ * bi.cross(bj)));
  }
  return volume_m3 * k;
}

Mat3 viscous_block(const TetraMaterial& m, double volume_m3, const Vec3& bi, const Vec3& bj, const Mat3& f) {
  const Vec3 fi = f * bi, fj = f * bj;
  return volume_m3 *
         (m.viscous_mu * (bi.dot(bj) * f * f.transpose() + fj * fi.transpose()) + m.viscous_lambda * fi * fj.transpose());
}

}  // namespace palpate
