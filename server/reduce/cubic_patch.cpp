#include "server/reduce/cubic_patch.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/port/terms_pieces.hpp"
#include "server/reduce/dent.hpp"
#include "server/reduce/expansion.hpp"
#include "server/reduce/sample_springs.hpp"
#include "server/reduce/sample_tetrahedra.hpp"

namespace palpate {
namespace {

constexpr double kFloor = 0.02;      // of the scaled variables' singular values
constexpr double kSoftest = 1e-8;    // of the largest stiffness, where a mode has lost its own
constexpr double kNotLifted = 1e-9;  // of the largest stiffness: rounding
constexpr double kTrust = 1;         // of the last terms' force to the linear one, where trust ends
constexpr double kFarthest = 1e3;    // of a variable that no term bends
constexpr double kWrong = 0.5;       // of the force beyond the linear one, where terms are no longer trusted,
constexpr double kHarmless = 0.25;   // unless they are wrong by less than this of the linear one
constexpr double kMostBraked = 3;    // largest eigenvalue of D in steps: beyond, no damper of a polynomial or a touch turns
constexpr double kUnknown = 0.03;    // mean square of wrong parts, beyond which springs are the safer terms
constexpr double kAtRest = 1e-3;     // of what the hand is likely to do, below which nothing is likely
constexpr int kGraspLeading = 10, kTouchLeading = 8;  // most variables with terms of fourth order
constexpr double kLeast = 0.02;                       // of the radius: below, nobody asks any more

/// S of the modes, rows by falling energy.
Matrix mode_scale(const Patch& patch, const Matrix& coordinates) {
  const Vector root = patch.stiffness.cwiseMax(kSoftest * patch.stiffness.maxCoeff()).cwiseSqrt();
  const Eigen::JacobiSVD<Matrix> svd(root.asDiagonal() * coordinates, Eigen::ComputeFullU);
  const Vector& found = svd.singularValues();
  Vector sigma = Vector::Constant(root.size(), kFloor * found[0]);
  sigma.head(found.size()) = found.cwiseMax(kFloor * found[0]);
  return sigma.cwiseInverse().asDiagonal() * svd.matrixU().transpose() * root.asDiagonal();
}

bool is_lifted(const Patch& patch, const CubicShapes& shapes) {
  return shapes.lifted.cwiseAbs().maxCoeff() > kNotLifted * patch.stiffness.maxCoeff();
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

Vector elastic_at(CubicForce& terms, const Vector& u) {
  CubicForce::Variables force;
  terms.move_to(u);
  terms.elastic(force);
  return force;
}

/// How far along `way` (|way| = 1, u = t way) the terms are trusted, up to `far`.
double trusted_along(BentBody& body, const Matrix& t, CubicForce& terms, const Vector& way, double far) {
  for (double radius = far; radius >= kLeast;) {
    Vector linear;
    const Vector exact = t.transpose() * body.beyond_linear(radius * (t * way), linear);
    linear = t.transpose() * linear;
    const double wrong = (elastic_at(terms, radius * way) - exact).norm(),
                 most = std::max(kWrong * exact.norm(), kHarmless * linear.norm());
    if (exact.allFinite() && wrong <= most) return radius;
    // What is left out grows faster than what is there, by the square of the radius when both are small.
    radius *= exact.allFinite() ? std::clamp(std::sqrt(most / wrong), 1.0 / 3, 0.8) : 1.0 / 3;
  }
  return kLeast;
}

/// Least eigenvalue of K + dN/dy at y in the metric of K, K that of the body at the stamp.
double least_stiffness(CubicForce& terms, const Matrix& stiffness, const Vector& y) {
  constexpr double kStep = 1e-3;
  Matrix tangent(y.size(), y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const Vector step = kStep * Vector::Unit(y.size(), i);
    tangent.col(i) = (elastic_at(terms, y + step) - elastic_at(terms, y - step)) / (2 * kStep);
  }
  const Matrix whole = stiffness - 0.5 * (tangent + tangent.transpose());
  return Eigen::GeneralizedSelfAdjointEigenSolver<Matrix>(whole, stiffness, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// Up to which radius no tool that goes straight on, the body following, meets a body that gives way of itself: a polynomial may
/// lose its stiffness across where a body that was pressed and is let go regains it. That it does so several times as strongly as
/// the body held at the stamp is never the body's own doing; less may be: bodies do snap.
double stable_radius(CubicForce& terms, const Matrix& stiffness, Eigen::Index tool) {
  constexpr double kLeastLeft = -6, kShorter = 0.8;  // of the stiffness at the stamp
  const Eigen::Index modes = stiffness.rows() - tool;
  const Matrix follow = -stiffness.bottomRightCorner(modes, modes).ldlt().solve(stiffness.bottomLeftCorner(modes, tool));
  double radius = 1;
  for (Eigen::Index i = 0; i < tool; ++i) {
    Vector way(stiffness.rows());
    way << Vector::Unit(tool, i), follow.col(i);
    way.normalize();
    for (const double sign : {1.0, -1.0})
      while (radius > kLeast && least_stiffness(terms, stiffness, sign * radius * way) < kLeastLeft) radius *= kShorter;
  }
  return radius;
}

/// The radius.
double trusted_radius(BentBody& body, const CubicTerms& terms, const Matrix& ways, const Matrix& stiffness, Eigen::Index tool) {
  CubicTerms elastic = terms;  // of y itself, and without end
  elastic.scale.setIdentity();
  elastic.e2.resize(0);
  elastic.radius = kFarthest;
  CubicForce force(elastic);
  const Matrix t = terms.scale.inverse();
  double radius = stable_radius(force, stiffness, tool);
  for (Eigen::Index k = 0; k < ways.cols(); ++k) {
    const Vector way = terms.scale * ways.col(k);
    const double length = way.norm();
    if (std::isnormal(length)) {
      const double asked = std::min(radius, length), found = trusted_along(body, t, force, way / length, asked);
      if (found < asked) radius = found;
    }
  }
  return radius;
}

/// Of each variable alone, > 0.
Vector stiffness_of(const Patch& patch, Eigen::Index first) {
  Vector stiffness = joint_stiffness(patch, patch.stiffness).diagonal();
  stiffness.tail(patch.stiffness.size()) = stiffness.tail(patch.stiffness.size()).cwiseMax(kSoftest * patch.stiffness.maxCoeff());
  if (first > 0) stiffness.head(first) = stiffness.head(first).cwiseMax(kSoftest * stiffness.head(first).maxCoeff());
  return stiffness;
}

/// Of forces on the variables of a grasp, the one that holds the tool where the modes have followed: F = f_p + B_k^T K^-1 f_q.
Matrix held_tool(const Patch& patch, const Vector& stiffness) {
  Matrix felt(stiffness.size(), 3);
  felt << Mat3::Identity(), stiffness.tail(patch.modes()).cwiseInverse().asDiagonal() * patch.b_k;
  return felt;
}

/// The last of the columns among them.
Matrix every_second(const Matrix& of) {
  const Eigen::Index taken = (of.cols() + 1) / 2;
  return of(Eigen::all, Eigen::seqN((of.cols() + 1) % 2, taken, 2));
}

/// What samples lie on, and around: dents that a hand is likely to make; where a grasped body will be. All ways there of a solid;
/// of springs, which are exact where they are few enough and must then not be asked for too much that is alike, the one of a hand
/// that goes on, half and whole.
Matrix path_of(const CubicShapes& shapes, bool solid, const Matrix& dents) {
  if (shapes.dents > 0) return dents;
  const Matrix ahead = shapes.ways.rightCols(shapes.ahead);
  if (solid) return every_second(ahead);
  if (shapes.port.cols() == 0 || shapes.going_on < 2) return {};
  return ahead(Eigen::all, std::array<Eigen::Index, 2>{shapes.going_on / 2 - 1, shapes.going_on - 1});
}

/// Whether a mode is braked away within a third of a step of the player.
bool braked_fast(const Patch& patch, int steps) {
  const double fastest = Eigen::SelfAdjointEigenSolver<Matrix>(patch.damping, Eigen::EigenvaluesOnly).eigenvalues().tail<1>()[0];
  return fastest > kMostBraked * kHapticRateHz * steps;
}

}  // namespace

Matrix likely_ways(const CubicShapes& shapes) {
  constexpr double kUnyielding = (1 + Dents::kHand) / Dents::kHand;
  const Eigen::Index ways = shapes.ways.cols();
  Matrix u = Matrix::Zero(shapes.ways.rows(), ways + shapes.dents);
  u.leftCols(ways) = shapes.ways;
  u.bottomRightCorner(shapes.modes.cols(), shapes.dents) = kUnyielding * shapes.coordinates.rightCols(shapes.dents);
  return u;
}

BentBody::BentBody(const Linearisation& at, const CubicShapes& shapes)
    : at_(at), moved_(shapes.modes.rows(), shapes.port.cols() + shapes.modes.cols()) {
  const Eigen::Index first = shapes.port.cols();
  if (first > 0) moved_.leftCols(first) = shapes.port * shapes.amplitude.cwiseInverse().asDiagonal();
  moved_.rightCols(shapes.modes.cols()) = shapes.modes;
}

Vector BentBody::beyond_linear(const Vector& u, Vector& linear) {
  if (here_.size() == 0) {
    Matrix k_moved, d_moved;
    at_.multiply(moved_, k_moved, d_moved);
    stiffness_ = moved_.transpose() * k_moved;
    still_ = Vector::Zero(moved_.rows());
    at_.dynamics->forces(at_.state->x, still_, here_);
  }
  Vector there;
  at_.dynamics->forces(at_.state->x + moved_ * u, still_, there);
  linear = stiffness_ * u;
  return moved_.transpose() * (there - here_) + linear;
}

std::optional<CubicTerms> cubic_terms(BentBody& body, const Patch& patch, const CubicShapes& shapes, int vertices) {
  const auto r = patch.stiffness.size(), first = shapes.port.cols(), n = r + first;
  if (r == 0 || !(patch.stiffness.maxCoeff() > 0)) return std::nullopt;
  CubicTerms terms;
  terms.variables = static_cast<int>(n);
  terms.grasp = first > 0;
  const bool repaired = is_lifted(patch, shapes);
  terms.leading = leading_that_fit({terms.variables, terms.grasp, repaired, vertices},
                                   std::min(terms.variables, terms.grasp ? kGraspLeading : kTouchLeading));
  terms.scale = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i < first; ++i) terms.scale(i, i) = 1 / shapes.amplitude[i];
  terms.scale.bottomRightCorner(r, r) = mode_scale(patch, shapes.coordinates);
  const Matrix t = terms.scale.inverse();
  if (!t.allFinite()) return std::nullopt;
  auto expansion = expand(*body.at().dynamics, *body.at().state, body.moved() * t, terms.leading);
  if (!expansion) return std::nullopt;
  terms.e3 = std::move(expansion->e3);
  terms.e4 = std::move(expansion->e4);
  terms.q = std::move(expansion->q);
  if (braked_fast(patch, first > 0 ? kGraspSteps : kTouchSteps)) terms.q.setZero();
  if (repaired) terms.e2 = repair(shapes.lifted, t);
  Matrix form = t.transpose() * (joint_stiffness(patch, patch.stiffness) + shapes.lifted) * t;
  form.diagonal().array() += kNotLifted * form.diagonal().maxCoeff();  // nothing holds a tool that moves across a planar body
  const Vector far = trusted(terms, form);
  rescale(terms, far);
  terms.rate = stamp_rate(terms, patch);
  terms.radius = trusted_radius(body, terms, likely_ways(shapes), far.asDiagonal() * form * far.asDiagonal(), first);
  return terms;
}

std::optional<CubicTerms> sampled_terms(const BentBody& body, const Patch& patch, const CubicShapes& shapes, int vertices) {
  const auto r = patch.stiffness.size(), first = shapes.port.cols(), n = r + first;
  if (r == 0 || !(patch.stiffness.maxCoeff() > 0)) return std::nullopt;
  const bool repaired = is_lifted(patch, shapes);
  const int variables = static_cast<int>(n);
  Sampling sampling;
  sampling.room = {variables, first > 0, repaired, vertices, body.at().dynamics->body().law == SpringLaw::stiffening};
  if (first > 0) {
    Eigen::Index row = 0;
    shapes.port.cwiseAbs().rowwise().maxCoeff().maxCoeff(&row);
    sampling.tool = static_cast<int>(row / 3);
  }
  sampling.likely = Matrix::Zero(n, shapes.coordinates.cols() + shapes.ways.cols());
  sampling.likely.bottomLeftCorner(r, shapes.coordinates.cols()) = shapes.coordinates;
  sampling.likely.rightCols(shapes.ways.cols()) = shapes.ways;
  const bool solid = !body.at().dynamics->tetrahedra().empty();
  sampling.path = path_of(shapes, solid, sampling.likely.middleCols(shapes.coordinates.cols() - shapes.dents, shapes.dents));
  sampling.stiffness = stiffness_of(patch, first);
  if (solid && first > 0) sampling.felt = held_tool(patch, sampling.stiffness);
  if (first > 0) sampling.likely.topLeftCorner(first, first) = shapes.amplitude.asDiagonal();
  CubicTerms terms;
  terms.variables = variables;
  terms.grasp = first > 0;
  terms.scale = Matrix::Identity(n, n);
  if (solid) {
    if (auto tetrahedra = sample_tetrahedra(body.at(), body.moved(), sampling)) terms.solid = std::move(*tetrahedra);
  } else if (auto springs = sample_springs(body.at(), body.moved(), sampling)) {
    terms.springs = std::move(*springs);
  }
  if (!terms.sampled()) return std::nullopt;
  if (repaired) terms.e2 = repair(shapes.lifted, terms.scale);
  terms.rate = stamp_rate(terms, patch);
  const CubicForce force(terms, patch);
  if (force.empty()) return std::nullopt;
  if (first == 0 && braked_fast(patch, force.steps())) terms.springs.damping.setZero();
  return terms;
}

bool are_truer(BentBody& body, const Patch& patch, const CubicShapes& shapes, const CubicTerms& a, const CubicTerms& b) {
  const Matrix ways = likely_ways(shapes);
  const Eigen::Index first = shapes.port.cols();
  const Vector root = stiffness_of(patch, first).cwiseSqrt(), unit = root.cwiseInverse();
  const double moves = (root.asDiagonal() * ways).colwise().norm().maxCoeff();
  if (first > 0 && moves < kAtRest * root.head(first).cwiseProduct(shapes.amplitude).norm()) return false;
  Matrix asked(ways.rows(), 2 * ways.cols());
  asked << ways, 0.5 * ways;
  const auto unrepaired = [&](CubicTerms terms) {
    terms.e2.resize(0);
    return CubicForce(terms, patch);
  };
  std::array<CubicForce, 2> forces{unrepaired(a), unrepaired(b)};
  std::array<double, 2> errors{};
  for (Eigen::Index k = 0; k < asked.cols(); ++k) {
    Vector linear;
    const Vector exact = body.beyond_linear(asked.col(k), linear);
    const double size = unit.cwiseProduct(exact).norm() + kOfLinear * unit.cwiseProduct(linear).norm();
    if (!std::isnormal(size)) continue;
    for (std::size_t i = 0; i < forces.size(); ++i) {
      const double wrong = unit.cwiseProduct(elastic_at(forces[i], asked.col(k)) - exact).norm() / size;
      errors[i] += wrong < 1 ? wrong * wrong : 1.0;
    }
  }
  return errors[0] < errors[1] || errors[1] > kUnknown * static_cast<double>(asked.cols());
}

}  // namespace palpate
