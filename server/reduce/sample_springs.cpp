#include "server/reduce/sample_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/base/random.hpp"
#include "server/reduce/expansion.hpp"
#include "server/reduce/sparse_weights.hpp"

namespace palpate {
namespace {

constexpr int kSamples = 32, kMoreOnPath = 8, kAlone = 3, kAround = 12, kCandidates = 250;
constexpr double kLengthMin = 1e-9;    // below, a spring has no direction [m]
constexpr double kNegligible = 1e-2;   // of the bending, in springs that are not looked at
constexpr float kOfLinear = 0.1F;      // an error that small beside the linear force is felt by nobody
constexpr float kCloseEnough = 3e-3F;  // of all samples together

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// u_s, a column each.
Matrix samples(const SpringSampling& sampling) {
  constexpr double kFar = 1.5, kLittle = 0.3;
  const Matrix &likely = sampling.likely, &path = sampling.path;
  Random random(1);
  const auto draw = [&] { return random.uniform(-1, 1); };
  Matrix u(likely.rows(), kSamples + (path.cols() > 0 ? kMoreOnPath : 0));
  Eigen::Index k = 0;
  for (Eigen::Index i = 0; i < path.cols(); ++i)
    for (const double much : {0.5, 1.0, 1.5}) u.col(k++) = much * path.col(i);
  for (Eigen::Index i = 0; path.cols() > 0 && i < kAround; ++i) {
    Vector mixture(likely.cols());
    for (double& part : mixture) part = kLittle * draw();
    u.col(k++) = random.uniform(0, kFar) * path.col(i % path.cols()) + 0.5 * draw() * path.col((i + 1) % path.cols()) +
                 0.5 * likely * mixture;
  }
  for (Eigen::Index i = 0; i < std::min<Eigen::Index>(kAlone, likely.cols()); ++i)
    for (const double much : {1.0, -1.0, 2.0, -2.0}) u.col(k++) = much * likely.col(i);
  for (; k < u.cols(); ++k) {
    Vector mixture(likely.cols());
    for (double& part : mixture) part = draw() * (draw() > 1.0 / 3 ? kFar : kLittle);
    u.col(k) = kFar * draw() * (likely * mixture);
  }
  return u;
}

/// What springs add to the linear force at the samples, a row each.
struct Bending {
  std::vector<std::uint32_t> elements;
  std::array<Rows, 3> motion;  ///< G_e by axes, springs x n
  std::array<Rows, 3> force;   ///< springs x samples
};

float stiffening_of(const LumpedBody& body) {
  return body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F;
}

/// From how far a spring's ends move apart to what it pulls with beyond the linear force, all samples side by side.
template <typename Samples>
void bend(const Element& element, float stiffening, const Eigen::Vector3f& d, Samples x, Samples y, Samples z) {
  using Each = Eigen::Array<float, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kSamples + kMoreOnPath>;
  const auto k = static_cast<float>(element.stiffness_n_m), rest = static_cast<float>(element.rest_length_m);
  const float length = d.norm(), strain = (length - rest) / rest;
  const float tension = k * rest * strain * (1 + stiffening * strain * strain), across = tension / length;
  const float along = k * (1 + 3 * stiffening * strain * strain) - across;
  const Eigen::Vector3f n = d / length;
  const Each there_x = x + d.x(), there_y = y + d.y(), there_z = z + d.z();
  const Each now = (there_x.square() + there_y.square() + there_z.square()).sqrt().max(static_cast<float>(kLengthMin));
  const Each bent = (now - rest) / rest;
  const Each pull = k * rest * bent * (1 + stiffening * bent.square()) / now;
  const Each turned = tension + along * (n.x() * x + n.y() * y + n.z() * z);
  x = pull * there_x - turned * n.x() - across * x;
  y = pull * there_y - turned * n.y() - across * y;
  z = pull * there_z - turned * n.z() - across * z;
}

std::optional<Bending> bend(const Linearisation& at, const SpringSampling& sampling, const Matrix& u) {
  const LumpedBody& body = at.dynamics->body();
  Bending b;
  // |G u| over all samples is |G L|, L L^T = u u^T: fewer columns.
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(u * u.transpose());
  const Matrix root = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  b.elements = elements_that_bend(*at.dynamics, *at.state, sampling.moved * root, kNegligible);
  const auto count = static_cast<Eigen::Index>(b.elements.size());
  for (Rows& rows : b.motion) rows.resize(count, u.rows());
  for (Eigen::Index e = 0; e < count; ++e) {
    const Element& element = body.elements[b.elements[static_cast<std::size_t>(e)]];
    for (int axis = 0; axis < 3; ++axis)
      b.motion[static_cast<std::size_t>(axis)].row(e) = (sampling.moved.row(3 * static_cast<Eigen::Index>(element.b) + axis) -
                                                         sampling.moved.row(3 * static_cast<Eigen::Index>(element.a) + axis))
                                                            .cast<float>();
  }
  const Eigen::MatrixXf way = u.cast<float>();
  for (std::size_t axis = 0; axis < 3; ++axis) b.force[axis] = b.motion[axis] * way;
  const float stiffening = stiffening_of(body);
  for (Eigen::Index e = 0; e < count; ++e) {
    const Element& element = body.elements[b.elements[static_cast<std::size_t>(e)]];
    const Vec3 span = at.state->x.segment<3>(3 * static_cast<Eigen::Index>(element.b)) -
                      at.state->x.segment<3>(3 * static_cast<Eigen::Index>(element.a));
    if (!(span.norm() > kLengthMin)) return std::nullopt;
    bend(element, stiffening, span.cast<float>(), b.force[0].row(e).array(), b.force[1].row(e).array(),
         b.force[2].row(e).array());
  }
  return b;
}

/// The springs with the largest forces times motions, by their rows.
std::vector<Eigen::Index> largest(const Bending& b) {
  Eigen::VectorXf part = Eigen::VectorXf::Zero(b.motion[0].rows()), moves = part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    part += b.force[axis].rowwise().squaredNorm();
    moves += b.motion[axis].rowwise().squaredNorm();
  }
  part = part.cwiseProduct(moves);
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(part.size()));
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  const auto kept = std::min<std::size_t>(rows.size(), kCandidates);
  std::partial_sort(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(kept), rows.end(),
                    [&](Eigen::Index i, Eigen::Index j) { return part[i] != part[j] ? part[i] > part[j] : i < j; });
  rows.resize(kept);
  return rows;
}

/// The springs of these rows with their weights.
SampledSprings chosen(const Linearisation& at, const Bending& b, const std::vector<Eigen::Index>& rows, const SparseWeights& w) {
  const LumpedBody& body = at.dynamics->body();
  SampledSprings springs;
  const auto count = static_cast<Eigen::Index>(w.columns.size());
  springs.stiffening = stiffening_of(body);
  springs.motion.resize(3 * count, b.motion[0].cols());
  springs.span.resize(3, count);
  springs.rest_length.resize(count);
  springs.stiffness.resize(count);
  springs.damping.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index row = rows[static_cast<std::size_t>(w.columns[static_cast<std::size_t>(k)])];
    const Element& e = body.elements[b.elements[static_cast<std::size_t>(row)]];
    for (int axis = 0; axis < 3; ++axis) springs.motion.row(3 * k + axis) = b.motion[static_cast<std::size_t>(axis)].row(row);
    springs.span.col(k) =
        (at.state->x.segment<3>(3 * static_cast<Eigen::Index>(e.b)) - at.state->x.segment<3>(3 * static_cast<Eigen::Index>(e.a)))
            .cast<float>();
    springs.rest_length[k] = static_cast<float>(e.rest_length_m);
    springs.stiffness[k] = w.weights[k] * static_cast<float>(e.stiffness_n_m);
    springs.damping[k] = w.weights[k] * static_cast<float>(e.damping_n_s_m);
  }
  return springs;
}

/// Bending as forces on the variables, in units in which every sample counts alike.
struct Fit {
  Eigen::MatrixXf parts;  ///< of each of `rows`, a column each: n x samples
  Eigen::VectorXf all;    ///< of all springs
};

Fit fit_of(const Bending& b, const std::vector<Eigen::Index>& rows, const Matrix& u, const Vector& stiffness) {
  const Eigen::VectorXf unit = stiffness.cwiseSqrt().cwiseInverse().cast<float>();
  const Eigen::Index n = u.rows();
  Eigen::MatrixXf all = Eigen::MatrixXf::Zero(n, u.cols());
  for (std::size_t axis = 0; axis < 3; ++axis) all += b.motion[axis].transpose() * b.force[axis];
  all = unit.asDiagonal() * all;
  const Eigen::MatrixXf linear = unit.cwiseInverse().asDiagonal() * u.cast<float>();
  const Eigen::VectorXf size = (all.colwise().norm() + kOfLinear * linear.colwise().norm()).cwiseMax(1e-30F).transpose();
  Fit fit;
  fit.all = (all * size.cwiseInverse().asDiagonal()).reshaped();
  fit.parts.resize(n * u.cols(), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    auto part = fit.parts.col(static_cast<Eigen::Index>(k)).reshaped(n, u.cols());
    part.setZero();
    for (std::size_t axis = 0; axis < 3; ++axis) part += b.motion[axis].row(rows[k]).transpose() * b.force[axis].row(rows[k]);
    part = unit.asDiagonal() * part * size.cwiseInverse().asDiagonal();
  }
  return fit;
}

}  // namespace

std::optional<SampledSprings> sample_springs(const Linearisation& at, const SpringSampling& sampling) {
  const Matrix u = samples(sampling);
  const auto b = bend(at, sampling, u);
  if (!b || b->elements.empty()) return std::nullopt;
  const std::vector<Eigen::Index> rows = largest(*b);
  const Fit fit = fit_of(*b, rows, u, sampling.stiffness);
  const SparseWeights w = sparse_weights(fit.parts, fit.all, sampling.springs, kCloseEnough);
  if (w.columns.empty()) return std::nullopt;
  return chosen(at, *b, rows, w);
}

}  // namespace palpate
