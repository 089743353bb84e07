#include "server/reduce/cubic_patch.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "common/port/terms_pieces.hpp"
#include "server/reduce/expansion.hpp"
#include "server/reduce/lift.hpp"

namespace palpate {
namespace {

constexpr double kFloor = 0.02;      // of the scaled variables' singular values
constexpr double kSoftest = 1e-8;    // of the largest stiffness, where a mode has lost its own
constexpr double kNotLifted = 1e-9;  // of the largest stiffness: rounding
constexpr double kTrust = 1;         // of the last terms' force to the linear one, where trust ends
constexpr double kFarthest = 1e3;    // of a variable that no term bends

/// S of the modes, rows by falling energy.
Matrix mode_scale(const Patch& patch, const Matrix& coordinates) {
  const Vector root = patch.stiffness.cwiseMax(kSoftest * patch.stiffness.maxCoeff()).cwiseSqrt();
  const Eigen::JacobiSVD<Matrix> svd(root.asDiagonal() * coordinates, Eigen::ComputeFullU);
  const Vector& found = svd.singularValues();
  Vector sigma = Vector::Constant(root.size(), kFloor * found[0]);
  sigma.head(found.size()) = found.cwiseMax(kFloor * found[0]);
  return sigma.cwiseInverse().asDiagonal() * svd.matrixU().transpose() * root.asDiagonal();
}

/// Coefficients of E2 in y, u = T y.
Eigen::VectorXf repair(const Matrix& lifted, const Matrix& t) {
  const Matrix form = t.transpose() * lifted * t;
  Eigen::VectorXf e2(pairs_of(static_cast<int>(t.cols())));
  for (int j = 0; j < t.cols(); ++j)
    for (int i = 0; i <= j; ++i) e2[pair_at(i, j)] = static_cast<float>((i == j ? 0.5 : 1.0) * form(i, j));
  return e2;
}

/// How far each variable may go before the last term that it has is kTrust of the linear force.
Vector trusted(const CubicTerms& terms, const Matrix& form) {
  Vector far(terms.variables);
  for (int i = 0; i < terms.variables; ++i) {
    const double linear = kTrust * std::abs(form(i, i));
    const double last = i < terms.leading ? 4.0 * std::abs(static_cast<double>(terms.e4[quadruple_at(i, i, i, i)]))
                                          : 3.0 * std::abs(static_cast<double>(terms.e3[triple_at(i, i, i)]));
    const double part = linear < kFarthest * kFarthest * last ? linear / last : kFarthest * kFarthest;
    far[i] = i < terms.leading ? std::sqrt(part) : std::min(part, kFarthest);
  }
  return far;
}

/// The same terms in variables y_i / far_i.
void rescale(CubicTerms& terms, const Vector& far) {
  const Eigen::VectorXf f = far.cast<float>();
  terms.scale = far.cwiseInverse().asDiagonal() * terms.scale;
  const int n = terms.variables, l = terms.leading;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j <= k; ++j) {
      if (terms.e2.size() > 0) terms.e2[pair_at(j, k)] *= f[j] * f[k];
      for (int i = 0; i <= j; ++i) terms.e3[triple_at(i, j, k)] *= f[i] * f[j] * f[k];
    }
  for (int m = 0; m < l; ++m)
    for (int k = 0; k <= m; ++k)
      for (int j = 0; j <= k; ++j)
        for (int i = 0; i <= j; ++i) terms.e4[quadruple_at(i, j, k, m)] *= f[i] * f[j] * f[k] * f[m];
  for (int k = 0; k < l; ++k)
    for (int j = 0; j <= k; ++j) terms.q.col(pair_at(j, k)).array() *= f.head(l).array() * (f[j] * f[k]);
}

}  // namespace

std::optional<CubicTerms> cubic_terms(const Dynamics& dynamics, const BodyState& state, const Patch& patch,
                                      const CubicShapes& shapes, int leading) {
  const auto r = patch.stiffness.size(), first = shapes.port.cols(), n = r + first;
  if (r == 0 || !(patch.stiffness.maxCoeff() > 0)) return std::nullopt;
  CubicTerms terms;
  terms.variables = static_cast<int>(n);
  terms.leading = std::min({leading, terms.variables, kMaxLeading});
  terms.grasp = first > 0;
  terms.scale = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i < first; ++i) terms.scale(i, i) = 1 / shapes.amplitude[i];
  terms.scale.bottomRightCorner(r, r) = mode_scale(patch, shapes.coordinates);
  const Matrix t = terms.scale.inverse();
  if (!t.allFinite()) return std::nullopt;
  Matrix moved(shapes.modes.rows(), n);
  moved.leftCols(first) = shapes.port;
  moved.rightCols(r) = shapes.modes * t.bottomRightCorner(r, r);
  auto expansion = expand(dynamics, state, moved, terms.leading);
  if (!expansion) return std::nullopt;
  terms.e3 = std::move(expansion->e3);
  terms.e4 = std::move(expansion->e4);
  terms.q = std::move(expansion->q);
  if (shapes.lifted.cwiseAbs().maxCoeff() > kNotLifted * patch.stiffness.maxCoeff()) terms.e2 = repair(shapes.lifted, t);
  const Vector far = trusted(terms, t.transpose() * (joint_stiffness(patch, patch.stiffness) + shapes.lifted) * t);
  rescale(terms, far);
  terms.rate = stamp_rate(terms, patch);
  terms.radius = 1;
  return terms;
}

}  // namespace palpate
