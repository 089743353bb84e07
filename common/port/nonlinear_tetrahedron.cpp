#include "common/port/nonlinear_tetrahedron.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/mechanics/polar.hpp"
#include "common/port/polar_lanes.hpp"

namespace palpate {
namespace {

TetraLanes product(const TetraLanes& a, const TetraLanes& b) {
  TetraLanes c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return c;
}
/// Returns the change of the cofactors of A by B, to first order.
TetraLanes mixed_cofactors(const TetraLanes& a, const TetraLanes& b) {
  TetraLanes x;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t r = 3 * ((i + 1) % 3), s = 3 * ((i + 2) % 3), p = (j + 1) % 3, q = (j + 2) % 3;
      x[3 * i + j] = a[r + p] * b[s + q] + b[r + p] * a[s + q] - a[r + q] * b[s + p] - b[r + q] * a[s + p];
    }
  return x;
}
TetraLanes cofactors_of(const TetraLanes& a) {
  TetraLanes g;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t r = 3 * ((i + 1) % 3), s = 3 * ((i + 2) % 3), p = (j + 1) % 3, q = (j + 2) % 3;
      g[3 * i + j] = a[r + p] * a[s + q] - a[r + q] * a[s + p];
    }
  return g;
}

using Axial = std::array<TetraLane, 3>;

/// Returns t of A: A_32 - A_23, ...
Axial axial_part(const TetraLanes& a) { return {a[7] - a[5], a[2] - a[6], a[3] - a[1]}; }

Axial times(const TetraLanes& a, const Axial& t) {
  Axial v;
  for (std::size_t i = 0; i < 3; ++i) v[i] = a[3 * i] * t[0] + a[3 * i + 1] * t[1] + a[3 * i + 2] * t[2];
  return v;
}

/// [w]x
TetraLanes skew(const Axial& w) {
  const TetraLane none = TetraLane::Zero();
  return {none, -w[2], w[1], w[2], none, -w[0], -w[1], w[0], none};
}

/// Returns the rotation of a quaternion of nearly unit length, minus 1.
TetraLanes turned_by(const std::array<TetraLane, 4>& q) {
  const TetraLane &w = q[0], &x = q[1], &y = q[2], &z = q[3];
  const TetraLane twice = 2.0F / (w * w + x * x + y * y + z * z);
  const TetraLane ax = twice * x, ay = twice * y, az = twice * z;
  const TetraLane xx = ax * x, yy = ay * y, zz = az * z, xy = ax * y, yz = ay * z, zx = az * x;
  const TetraLane wx = ax * w, wy = ay * w, wz = az * w;
  return {-(yy + zz), xy - wz, zx + wy, xy + wz, -(zz + xx), yz - wx, zx - wy, yz + wx, -(xx + yy)};
}

/// Computes R' from F', in doubles like the body's.
void find(const TetraLanes& f, ElementRotation& turned) {
  Mat<kTetraLane> of, r;
  Quaternion<kTetraLane> q;
  for (std::size_t i = 0; i < 9; ++i)
    for (int l = 0; l < kTetraLane; ++l) of.of[i / 3][i % 3][l] = static_cast<double>(f[i][l]);
  polar_rotations(of, q, r);
  Doubles<kTetraLane> length;
  roots<kTetraLane>(q.of[0] * q.of[0] + q.of[1] * q.of[1] + q.of[2] * q.of[2] + q.of[3] * q.of[3], length);
  for (std::size_t i = 0; i < 4; ++i)
    for (int l = 0; l < kTetraLane; ++l) turned.q[i][l] = static_cast<float>(q.of[i][l] / length[l]);
  turned.d = turned_by(turned.q);
}

/// The same by Newton's method from an R' nearby, rotating by 2 atan(|w| / 2) instead of atan |w|: of the same order, without a
/// root. Returns false where that does not lead there.
bool turn_to(const TetraLanes& at_stamp, const TetraLanes& df, ElementRotation& turned) {
  constexpr int kNewtonStepsMax = 4;        // third order: two steps bring |w| = 0.1 below rounding
  constexpr float kNearTurnSquare = 2;      // limit of |w|^2: beyond, R' is not near, and Newton's method may not converge
  constexpr float kLastTurnSquare = 1e-5F;  // limit of |w|^2: the third power of such a rotation, 3e-8, is lost in rounding
  constexpr float kMinorMin = 0.02F;        // limit of a leading minor of H, in powers of the trace: below, H is nearly singular
  const TetraLanes f = sum(at_stamp, df);
  for (int k = 0; k < kNewtonStepsMax; ++k) {
    const TetraLanes more = sum(transposed_product(turned.d, f), df), s = sum(at_stamp, more);  // R'^T F' minus F, and all
    const Axial t = axial_part(more);
    const TetraLane trace = s[0] + s[4] + s[8];
    // H = (trace) 1 - R'^T F', symmetric, and its cofactors
    const TetraLane xx = s[4] + s[8], yy = s[8] + s[0], zz = s[0] + s[4];
    const TetraLane xy = -0.5F * (s[1] + s[3]), yz = -0.5F * (s[5] + s[7]), zx = -0.5F * (s[2] + s[6]);
    const TetraLane gxx = yy * zz - yz * yz, gxy = yz * zx - xy * zz, gzx = xy * yz - yy * zx;
    const TetraLane gyy = zz * xx - zx * zx, gyz = xy * zx - xx * yz, gzz = xx * yy - xy * xy;
    const TetraLane det = xx * gxx + xy * gxy + zx * gzx, half = 0.5F / det;
    const Axial h{half * (gxx * t[0] + gxy * t[1] + gzx * t[2]), half * (gxy * t[0] + gyy * t[1] + gyz * t[2]),
                  half * (gzx * t[0] + gyz * t[1] + gzz * t[2])};  // w / 2
    const TetraLane size = 4.0F * (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]), least = kMinorMin * trace;
    const auto near =
        (size <= kNearTurnSquare) && (trace > 0.0F) && (xx > least) && (gzz > least * trace) && (det > least * trace.square());
    if (!near.all()) return false;
    auto& q = turned.q;
    const TetraLane shorter = 1.5F - 0.5F * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const TetraLane w = shorter * q[0], x = shorter * q[1], y = shorter * q[2], z = shorter * q[3];
    q = {w - (x * h[0] + y * h[1] + z * h[2]), x + w * h[0] + (y * h[2] - z * h[1]), y + w * h[1] + (z * h[0] - x * h[2]),
         z + w * h[2] + (x * h[1] - y * h[0])};
    turned.d = turned_by(q);
    if ((size <= kLastTurnSquare).all()) return true;
  }
  return false;
}

struct NeoHookeanResidual {
  TetraLanes c;
  TetraLane f, q, det, d, e, j;

  NeoHookeanResidual(const ElementLinearisation& at, const TetraLanes& df)
      : c(cofactors_of(df)),
        f(inner(at.f, df)),
        q(inner(df, df)),
        det(inner(df, c) * (1.0F / 3)),
        d(2 * f + q),
        e(inner(at.f, c) + det),
        j(inner(at.g, df) + e) {}
};

TetraLanes neo_hookean_stress(const ElementLinearisation& at, const TetraLanes& df) {
  const NeoHookeanResidual b(at, df);
  const TetraLane inverse = 1 / (at.size * (at.size + b.d));
  const TetraLane by_df = at.mu * b.d * inverse, by_f = at.mu * (b.q * at.size - 2 * b.f * b.d) * inverse / at.size;
  const TetraLane by_x = at.lambda * b.j, by_g = at.lambda * b.e, by_c = by_x + at.pressure;
  const TetraLanes x = mixed_cofactors(at.f, df);
  TetraLanes q;
  for (std::size_t i = 0; i < 9; ++i) q[i] = by_df * df[i] + by_f * at.f[i] + by_x * x[i] + by_g * at.g[i] + by_c * b.c[i];
  return q;
}

constexpr auto kGrowthEnd = static_cast<float>(kLogGrowthMax);  // 4 is exact in single precision
constexpr float kExpSeriesMax = 0.5F;  // limit of |x|: a series of seven terms is accurate to rounding, beyond it little cancels

/// Returns exp(x) - 1 - x, without a difference of numbers that nearly cancel.
TetraLane second_of_exp(const TetraLane& x) {
  const TetraLane series =
      0.5F * x.square() *
      (1 + x * (1.0F / 3) * (1 + x * 0.25F * (1 + x * 0.2F * (1 + x * (1.0F / 6) * (1 + x * (1.0F / 7) * (1 + x * 0.125F))))));
  const auto near = (x.abs() < kExpSeriesMax).eval();
  return near.all() ? series : TetraLane(near.select(series, x.exp() - 1 - x));
}

/// Returns exp(x) - 1 - x - x^2 / 2 in the same way.
TetraLane third_of_exp(const TetraLane& x) {
  const TetraLane series =
      (1.0F / 6) * x.cube() *
      (1 + x * 0.25F * (1 + x * 0.2F * (1 + x * (1.0F / 6) * (1 + x * (1.0F / 7) * (1 + x * 0.125F * (1 + x * (1.0F / 9)))))));
  return (x.abs() < kExpSeriesMax).select(series, second_of_exp(x) - 0.5F * x.square());
}

struct InvariantResidual {
  TetraLanes c, x;
  TetraLane q, det, e, j, delta, rest;  // rest: q - 2 e, delta beyond its first order
  // Where e follows the exponential at the other end: exp(y) - 1 and its part beyond first order, y = b delta. Else by
  // differences.
  TetraLane y;
  Eigen::Array<bool, kTetraLane, 1> smooth;

  InvariantResidual(const ElementLinearisation& at, const TetraLanes& df)
      : c(cofactors_of(df)), x(mixed_cofactors(at.f, df)), q(inner(df, df)), det(inner(df, c) * (1.0F / 3)) {
    e = inner(at.f, c) + det;
    j = inner(at.g, df) + e;
    rest = q - 2 * e;
    delta = 2 * (inner(at.f, df) - j) + q;
    y = at.exponent * delta;
    smooth = (at.size <= kGrowthEnd) && (at.size + y <= kGrowthEnd);
  }

  /// Returns e at the other end.
  TetraLane growth(const ElementLinearisation& at) const {
    const TetraLane there = at.size + y;
    return there.min(kGrowthEnd).exp() * (1 + (there - kGrowthEnd).max(0.0F));
  }
  /// Computes the change of e and its part beyond first order, both without mu_1.
  void changes(const ElementLinearisation& at, TetraLane& first, TetraLane& second) const {
    const TetraLane beyond = second_of_exp(y);
    first = at.growth * (beyond + y);
    second = at.growth * beyond;
    if (smooth.all()) return;
    const TetraLane direct = growth(at) - at.growth;
    first = smooth.select(first, direct).eval();
    second = smooth.select(second, direct - slope_of(at) * y).eval();
  }
  /// Returns the integral of e over the change of I_1, minus its first and second order in delta.
  TetraLane integral(const ElementLinearisation& at) const {
    const TetraLane small = delta * y.square() * (1.0F / 6);  // where y is 0 the quotient below is undefined
    const TetraLane of_exp = (y.abs() < 1e-3F).select(small, third_of_exp(y) / at.exponent.max(1e-20F));
    const TetraLane direct = (integral_from_rest(at.size + y) - integral_from_rest(at.size)) / at.exponent.max(1e-20F) -
                             at.growth * delta - 0.5F * slope_of(at) * y * delta;
    return smooth.select(at.growth * of_exp, direct);
  }
  static TetraLane slope_of(const ElementLinearisation& at) { return at.size.min(kGrowthEnd).exp(); }
  static TetraLane integral_from_rest(const TetraLane& size) {
    const TetraLane end = size.min(kGrowthEnd).exp(), beyond = (size - kGrowthEnd).max(0.0F);
    return end - 1 + end * beyond * (1 + 0.5F * beyond);
  }
};

TetraLanes invariant_stress(const ElementLinearisation& at, const TetraLanes& df) {
  const InvariantResidual b(at, df);
  TetraLane first, second;
  b.changes(at, first, second);
  const TetraLane by_way = at.mu * second + at.slope * b.rest, by_df = at.mu * first, by_x = at.lambda * b.j;
  TetraLanes q;
  for (std::size_t i = 0; i < 9; ++i)
    q[i] = by_df * (df[i] - b.x[i] - b.c[i]) + by_way * (at.f[i] - at.g[i]) + by_x * (b.x[i] + b.c[i]) +
           at.lambda * b.e * at.g[i] + at.pressure * b.c[i];
  const TetraLanes of_f = mixed_cofactors(at.f, b.c), of_df = mixed_cofactors(df, sum(b.x, b.c));
  for (std::size_t i = 0; i < 9; ++i) q[i] += at.mu_2 * (of_f[i] + of_df[i]);
  return q;
}

TetraLane invariant_energy(const ElementLinearisation& at, const TetraLanes& df) {
  const InvariantResidual b(at, df);
  return 0.5F * at.mu * b.integral(at) + 0.25F * at.slope * b.rest * (2 * b.delta - b.rest) +
         0.5F * at.mu_2 * (2 * inner(b.x, b.c) + inner(b.c, b.c)) + 0.5F * at.lambda * b.e * (2 * b.j - b.e) +
         at.pressure * b.det;
}

struct CorotationalResidual {
  Axial first;  // W t
  TetraLane r, e;

  CorotationalResidual(const ElementLinearisation& at, const TetraLanes& df, const TetraLanes& change)
      : first(times(at.w, axial_part(df))), r(df[0] + df[4] + df[8]), e(inner(change, sum(at.f, df))) {}
};

TetraLanes corotational_stress(const ElementLinearisation& at, const TetraLanes& df, const TetraLanes& change) {
  const CorotationalResidual b(at, df, change);
  const TetraLane by_turned = at.lambda * b.e, by_change = by_turned + at.lambda * b.r;
  const TetraLanes first = skew(b.first);
  TetraLanes q;
  for (std::size_t i = 0; i < 9; ++i) q[i] = at.pressure * (change[i] - first[i]) + by_change * change[i];
  for (const std::size_t i : {0U, 4U, 8U}) q[i] += by_turned;
  return q;
}

TetraLane neo_hookean_energy(const ElementLinearisation& at, const TetraLanes& df) {
  const NeoHookeanResidual b(at, df);
  const TetraLane z = b.d / at.size, first = 2 * b.f / at.size;
  return 0.5F * at.mu * (z - z.log1p() - 0.5F * first.square()) + 0.5F * at.lambda * b.e * (2 * b.j - b.e) + at.pressure * b.det;
}

TetraLane corotational_energy(const ElementLinearisation& at, const TetraLanes& df, const TetraLanes& change) {
  const CorotationalResidual b(at, df, change);
  return (0.5F * at.lambda * at.size - at.mu) * (2 * b.e - inner(skew(b.first), df)) + 0.5F * at.lambda * b.e * (b.e + 2 * b.r);
}

/// Changes of Green's strain of a membrane, X and Y.
struct MembraneResidual {
  TetraLanes x, y;

  MembraneResidual(const ElementLinearisation& at, const TetraLanes& df) : y(transposed_product(df, df)) {
    const TetraLanes cross = transposed_product(at.f, df);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) x[3 * i + j] = 0.5F * (cross[3 * i + j] + cross[3 * j + i]);
    for (TetraLane& entry : y) entry *= 0.5F;
  }
};

TetraLane trace_of(const TetraLanes& m) { return m[0] + m[4] + m[8]; }

/// Returns A S(E).
TetraLanes pulled(const ElementLinearisation& at, const TetraLanes& a, const TetraLanes& e) {
  TetraLanes p = product(a, e);
  const TetraLane volume = at.lambda * trace_of(e);
  for (std::size_t i = 0; i < 9; ++i) p[i] = 2 * at.mu * p[i] + volume * a[i];
  return p;
}

TetraLanes membrane_stress(const ElementLinearisation& at, const TetraLanes& df) {
  const MembraneResidual b(at, df);
  return sum(pulled(at, at.f, b.y), pulled(at, df, sum(b.x, b.y)));
}

TetraLane membrane_energy(const ElementLinearisation& at, const TetraLanes& df) {
  const MembraneResidual b(at, df);
  const TetraLane own = trace_of(b.y);
  return at.mu * (2 * inner(b.x, b.y) + inner(b.y, b.y)) + at.lambda * own * (trace_of(b.x) + 0.5F * own);
}

}  // namespace

Eigen::Matrix3d frame_of(SolidLaw law, const Eigen::Matrix3d& deformation) {
  return law == SolidLaw::corotational ? polar_rotation(deformation) : Eigen::Matrix3d::Identity();
}

ElementRotation::ElementRotation() {
  for (std::size_t i = 0; i < 4; ++i) q[i] = TetraLane::Constant(i == 0 ? 1.0F : 0.0F);
  d.fill(TetraLane::Zero());
}

ElementLinearisation::ElementLinearisation() {
  for (TetraLanes* const lanes : {&f, &g, &w})
    for (std::size_t i = 0; i < 9; ++i) (*lanes)[i] = TetraLane::Constant(i % 4 == 0 ? 1.0F : 0.0F);
  size = TetraLane::Constant(4);
  mu = lambda = pressure = mu_2 = exponent = slope = shear = TetraLane::Zero();
  growth = TetraLane::Ones();
}

void ElementLinearisation::set(int lane, const LawParameters& parameters, const Eigen::Matrix3d& deformation, double mu_l,
                               double lambda_l) {
  law = parameters;
  const SolidLaw kind = law.kind;
  Eigen::Matrix3d of_f = deformation;
  Eigen::Matrix3d of_g = Eigen::Matrix3d::Identity(), of_w = of_g;
  double of_size = 0, of_mu = mu_l, of_lambda = lambda_l, of_pressure = 0;
  if (kind == SolidLaw::neo_hookean) {
    of_mu = 4.0 / 3 * mu_l;
    of_lambda = lambda_l + 5.0 / 6 * mu_l;
    of_g = cofactors(deformation);
    of_size = deformation.squaredNorm() + 1;
    of_pressure = of_lambda * (deformation.col(0).dot(of_g.col(0)) - 1) - 0.75 * of_mu;
  } else if (is_of_invariants(kind)) {
    const InvariantModuli of = invariant_moduli(kind, law.shape, mu_l, lambda_l);
    of_mu = of.mu_1;
    of_lambda = of.lambda;
    of_g = cofactors(deformation);
    const double j = deformation.col(0).dot(of_g.col(0));
    of_size = of.exponent * (deformation.squaredNorm() - 1 - 2 * j);
    of_pressure = of_lambda * (j - 1) - of_mu * palpate::growth(of_size) - 2 * of.mu_2;
    mu_2[lane] = static_cast<float>(of.mu_2);
    exponent[lane] = static_cast<float>(of.exponent);
    growth[lane] = static_cast<float>(palpate::growth(of_size));
    slope[lane] = static_cast<float>(of_mu * of.exponent * growth_slope(of_size));
  } else if (kind == SolidLaw::membrane) {
    of_g.setZero();
  } else if (kind == SolidLaw::ogden) {
    of_mu = 0;
    of_lambda += OgdenLaw(law).sum * mu_l;
    of_g = cofactors(deformation);
  } else {
    of_f = 0.5 * (deformation + deformation.transpose());
    of_size = of_f.trace() - 3;
    of_pressure = of_lambda * of_size - 2 * of_mu;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(of_f);
    const Eigen::Vector3d pairs = (of_f.trace() - eigen.eigenvalues().array()).max(kLeastPairSum);
    of_w = eigen.eigenvectors() * pairs.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  }
  for (int i = 0; i < 9; ++i) {
    const auto k = static_cast<std::size_t>(i);
    f[k][lane] = static_cast<float>(of_f(i / 3, i % 3));
    g[k][lane] = static_cast<float>(of_g(i / 3, i % 3));
    w[k][lane] = static_cast<float>(of_w(i / 3, i % 3));
  }
  size[lane] = static_cast<float>(of_size);
  mu[lane] = static_cast<float>(of_mu);
  lambda[lane] = static_cast<float>(of_lambda);
  pressure[lane] = static_cast<float>(of_pressure);
  shear[lane] = mu[lane] * growth[lane] + slope[lane] + mu_2[lane];
  if (kind == SolidLaw::membrane) shear[lane] *= static_cast<float>(deformation.squaredNorm());
  if (!is_differenced(law)) return;
  if (!difference) difference.emplace();
  shear[lane] += static_cast<float>(difference->set(lane, law, deformation, mu_l, of_lambda));
}

void ElementLinearisation::spread() {
  const auto all = [](TetraLane& lane) { lane = TetraLane::Constant(lane[0]); };
  for (TetraLanes* const lanes : {&f, &g, &w}) std::for_each(lanes->begin(), lanes->end(), all);
  for (TetraLane* const lane : {&size, &mu, &lambda, &pressure, &mu_2, &exponent, &growth, &slope, &shear}) all(*lane);
  if (difference) difference->spread();
}

void turn(const ElementLinearisation& at, const TetraLanes& df, ElementRotation& turned) noexcept {
  if (at.law.kind != SolidLaw::corotational) return;
  if (!turn_to(at.f, df, turned)) find(sum(at.f, df), turned);
}

TetraLanes nonlinear_residual_stress(const ElementLinearisation& at, const TetraLanes& df,
                                     const ElementRotation& turned) noexcept {
  TetraLanes q;
  if (at.law.kind == SolidLaw::ogden)
    q.fill(TetraLane::Zero());
  else if (is_of_invariants(at.law.kind))
    q = invariant_stress(at, df);
  else if (at.law.kind == SolidLaw::membrane)
    q = membrane_stress(at, df);
  else
    q = at.law.kind == SolidLaw::neo_hookean ? neo_hookean_stress(at, df) : corotational_stress(at, df, turned.d);
  if (at.difference) at.difference->add_residual_stress(at.law, df, q);
  return q;
}

TetraLane nonlinear_residual_energy(const ElementLinearisation& at, const TetraLanes& df,
                                    const ElementRotation& turned) noexcept {
  TetraLane energy = TetraLane::Zero();
  if (is_of_invariants(at.law.kind))
    energy = invariant_energy(at, df);
  else if (at.law.kind == SolidLaw::membrane)
    energy = membrane_energy(at, df);
  else if (at.law.kind == SolidLaw::neo_hookean)
    energy = neo_hookean_energy(at, df);
  else if (at.law.kind == SolidLaw::corotational)
    energy = corotational_energy(at, df, turned.d);
  if (at.difference) energy += at.difference->residual_energy(at.law, df);
  return energy;
}

TetraLanes viscous_stress(const TetraLane& mu, const TetraLane& lambda, const TetraLanes& f, const TetraLanes& rate) noexcept {
  const TetraLanes b = transposed_product(f, rate);
  const TetraLane volume = lambda * (b[0] + b[4] + b[8]);
  TetraLanes s;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) s[3 * i + j] = mu * (b[3 * i + j] + b[3 * j + i]);
  for (const std::size_t i : {0U, 4U, 8U}) s[i] += volume;
  return product(f, s);
}

}  // namespace palpate
