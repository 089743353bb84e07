#include "common/port/bent_tetrahedron.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/port/polar.hpp"
#include "common/port/polar_lanes.hpp"

namespace palpate {
namespace {

TetraLanes product(const TetraLanes& a, const TetraLanes& b) {
  TetraLanes c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return c;
}
/// What the cofactors of A change by with B, to first order.
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

/// t of A: A_32 - A_23, ...
Axial axial_part(const TetraLanes& a) { return {a[7] - a[5], a[2] - a[6], a[3] - a[1]}; }

Axial times(const TetraLanes& a, const Axial& t) {
  Axial v;
  for (std::size_t i = 0; i < 3; ++i) v[i] = a[3 * i] * t[0] + a[3 * i + 1] * t[1] + a[3 * i + 2] * t[2];
  return v;
}

/// R [w]x
TetraLanes turned_by(const TetraLanes& r, const Axial& w) {
  TetraLanes d;
  for (std::size_t i = 0; i < 3; ++i) {
    d[3 * i] = r[3 * i + 1] * w[2] - r[3 * i + 2] * w[1];
    d[3 * i + 1] = r[3 * i + 2] * w[0] - r[3 * i] * w[2];
    d[3 * i + 2] = r[3 * i] * w[1] - r[3 * i + 1] * w[0];
  }
  return d;
}

/// The rotation of F, found in doubles as the body's is.
TetraLanes rotation_of(const TetraLanes& f) {
  Mat<kTetraLane> of, r;
  TetraLanes rotation;
  for (std::size_t i = 0; i < 9; ++i)
    for (int l = 0; l < kTetraLane; ++l) of.of[i / 3][i % 3][l] = static_cast<double>(f[i][l]);
  polar_rotations(of, r);
  for (std::size_t i = 0; i < 9; ++i)
    for (int l = 0; l < kTetraLane; ++l) rotation[i][l] = static_cast<float>(r.of[i / 3][i % 3][l]);
  return rotation;
}

/// The same by Newton's method from a rotation nearby (polar_lanes.hpp, 3.): found in few turns where it was the largest tr(R^T
/// F) that it came to, which is where the sums of two principal stretches are all above 0.
bool turn_to(const TetraLanes& f, TetraLanes& r) {
  constexpr int kTurns = 4;
  constexpr float kRounding = 1e-12F;  // of |t|^2 to (tr S)^2
  constexpr float kLeastPair = 0.02F;  // of tr S
  for (int k = 0;; ++k) {
    const TetraLanes s = transposed_product(r, f);
    const Axial t = axial_part(s);
    const TetraLane trace = s[0] + s[4] + s[8], size = trace.square();
    const TetraLane off = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
    // H = (tr S) 1 - S, symmetric
    const TetraLane xx = s[4] + s[8], yy = s[8] + s[0], zz = s[0] + s[4];
    const TetraLane xy = -0.5F * (s[1] + s[3]), yz = -0.5F * (s[5] + s[7]), zx = -0.5F * (s[2] + s[6]);
    const TetraLane gxx = yy * zz - yz * yz, gxy = yz * zx - xy * zz, gzx = xy * yz - yy * zx;
    const TetraLane det = xx * gxx + xy * gxy + zx * gzx;
    if ((off <= kRounding * size).all() || k == kTurns)
      return ((off <= kRounding * size) && (trace > 0.0F) && (xx > kLeastPair * trace) &&
              (xx * yy - xy * xy > kLeastPair * size) && (det > kLeastPair * size * trace))
          .all();
    const TetraLane gyy = zz * xx - zx * zx, gyz = xy * zx - xx * yz, gzz = xx * yy - xy * xy;
    const TetraLane inverse = 1.0F / det;
    const Axial w{inverse * (gxx * t[0] + gxy * t[1] + gzx * t[2]), inverse * (gxy * t[0] + gyy * t[1] + gyz * t[2]),
                  inverse * (gzx * t[0] + gyz * t[1] + gzz * t[2])};
    // 1 + c [w]x + c^2 / (1 + c) [w]x^2 turns by atan |w|
    const TetraLane c = 1.0F / (1.0F + (w[0] * w[0] + w[1] * w[1] + w[2] * w[2])).sqrt(), b = c * c / (1.0F + c);
    const TetraLanes once = turned_by(r, w), twice = turned_by(once, w);
    for (std::size_t i = 0; i < 9; ++i) r[i] += c * once[i] + b * twice[i];
  }
}

struct BentNeoHookean {
  TetraLane d, f, q, e, j, det;
  TetraLanes c;
};
BentNeoHookean bent_neo_hookean(const TetraStamp& at, const TetraLanes& df) {
  BentNeoHookean b;
  b.f = inner(at.f, df);
  b.q = inner(df, df);
  b.d = 2 * b.f + b.q;
  b.c = cofactors_of(df);
  b.det = inner(df, b.c) * (1.0F / 3);
  b.e = inner(at.f, b.c) + b.det;
  b.j = inner(at.g, df) + b.e;
  return b;
}

TetraLanes neo_hookean_stress(const TetraStamp& at, const TetraLanes& df) {
  const BentNeoHookean b = bent_neo_hookean(at, df);
  const TetraLane inverse = 1 / (at.size * (at.size + b.d));
  const TetraLane by_df = at.mu * b.d * inverse, by_f = at.mu * (b.q * at.size - 2 * b.f * b.d) * inverse / at.size;
  const TetraLane by_x = at.lambda * b.j, by_g = at.lambda * b.e, by_c = by_x + at.pressure;
  const TetraLanes x = mixed_cofactors(at.f, df);
  TetraLanes q;
  for (std::size_t i = 0; i < 9; ++i) q[i] = by_df * df[i] + by_f * at.f[i] + by_x * x[i] + by_g * at.g[i] + by_c * b.c[i];
  return q;
}

struct BentCorotational {
  TetraLanes turned, change, first;  // R', R' - R, dR
  TetraLane r, e;
};
BentCorotational bent_corotational(const TetraStamp& at, const TetraLanes& df) {
  BentCorotational b;
  TetraLanes f;
  for (std::size_t i = 0; i < 9; ++i) f[i] = at.f[i] + df[i];
  b.turned = at.g;
  if (!turn_to(f, b.turned)) b.turned = rotation_of(f);
  b.first = turned_by(at.g, times(at.w, axial_part(transposed_product(at.g, df))));
  for (std::size_t i = 0; i < 9; ++i) b.change[i] = b.turned[i] - at.g[i];
  b.r = inner(at.g, df);
  b.e = inner(b.change, f);
  return b;
}

TetraLanes corotational_stress(const TetraStamp& at, const TetraLanes& df) {
  const BentCorotational b = bent_corotational(at, df);
  const TetraLane by_turned = at.lambda * b.e, by_change = at.lambda * b.r;
  TetraLanes q;
  for (std::size_t i = 0; i < 9; ++i)
    q[i] = at.pressure * (b.change[i] - b.first[i]) + by_turned * b.turned[i] + by_change * b.change[i];
  return q;
}

}  // namespace

TetraStamp::TetraStamp() {
  for (TetraLanes* const lanes : {&f, &g, &w})
    for (std::size_t i = 0; i < 9; ++i) (*lanes)[i] = TetraLane::Constant(i % 4 == 0 ? 1.0F : 0.0F);
  size = TetraLane::Constant(4);
  mu = lambda = pressure = TetraLane::Zero();
}

void TetraStamp::set(int lane, SolidLaw law, const Eigen::Matrix3d& deformation, double mu_l, double lambda_l) {
  Eigen::Matrix3d of_g, of_w = Eigen::Matrix3d::Identity();
  double of_size = 0, of_mu = mu_l, of_lambda = lambda_l, of_pressure = 0;
  if (law == SolidLaw::neo_hookean) {
    of_mu = 4.0 / 3 * mu_l;
    of_lambda = lambda_l + 5.0 / 6 * mu_l;
    of_g = cofactors(deformation);
    of_size = deformation.squaredNorm() + 1;
    of_pressure = of_lambda * (deformation.col(0).dot(of_g.col(0)) - 1) - 0.75 * of_mu;
  } else {
    of_g = polar_rotation(deformation);
    const Eigen::Matrix3d s = of_g.transpose() * deformation;
    of_size = s.trace() - 3;
    of_pressure = of_lambda * of_size - 2 * of_mu;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (s + s.transpose()));
    const Eigen::Vector3d pairs = (s.trace() - eigen.eigenvalues().array()).max(kLeastPairSum);
    of_w = eigen.eigenvectors() * pairs.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  }
  for (int i = 0; i < 9; ++i) {
    const auto k = static_cast<std::size_t>(i);
    f[k][lane] = static_cast<float>(deformation(i / 3, i % 3));
    g[k][lane] = static_cast<float>(of_g(i / 3, i % 3));
    w[k][lane] = static_cast<float>(of_w(i / 3, i % 3));
  }
  size[lane] = static_cast<float>(of_size);
  mu[lane] = static_cast<float>(of_mu);
  lambda[lane] = static_cast<float>(of_lambda);
  pressure[lane] = static_cast<float>(of_pressure);
}

void TetraStamp::spread() {
  const auto all = [](TetraLane& lane) { lane = TetraLane::Constant(lane[0]); };
  for (TetraLanes* const lanes : {&f, &g, &w}) std::for_each(lanes->begin(), lanes->end(), all);
  for (TetraLane* const lane : {&size, &mu, &lambda, &pressure}) all(*lane);
}

TetraLanes stress_beyond_linear(SolidLaw law, const TetraStamp& at, const TetraLanes& df) noexcept {
  return law == SolidLaw::neo_hookean ? neo_hookean_stress(at, df) : corotational_stress(at, df);
}

TetraLane energy_beyond_linear(SolidLaw law, const TetraStamp& at, const TetraLanes& df) noexcept {
  if (law == SolidLaw::neo_hookean) {
    const BentNeoHookean b = bent_neo_hookean(at, df);
    const TetraLane z = b.d / at.size, first = 2 * b.f / at.size;
    return 0.5F * at.mu * (z - z.log1p() - 0.5F * first.square()) + 0.5F * at.lambda * b.e * (2 * b.j - b.e) +
           at.pressure * b.det;
  }
  const BentCorotational b = bent_corotational(at, df);
  return (0.5F * at.lambda * at.size - at.mu) * (2 * b.e - inner(b.first, df)) + 0.5F * at.lambda * b.e * (b.e + 2 * b.r);
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
