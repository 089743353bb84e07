#include "server/reduce/sample_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "common/base/random.hpp"
#include "server/reduce/expansion.hpp"
#include "server/reduce/sparse_weights.hpp"

namespace palpate {
namespace {

constexpr int kSamples = 64, kMoreOnPath = 8, kMixed = 40, kAlone = 3, kAround = 12, kCandidates = 500;
constexpr double kLengthMin = 1e-9;    // below, a spring has no direction [m]
constexpr double kNegligible = 1e-2;   // of the bending, in springs that are not looked at
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

/// What some springs add to the linear force at the samples, a row each.
struct Bending {
  std::array<Rows, 3> motion;  ///< G_e by axes, springs x n
  std::array<Rows, 3> force;   ///< springs x samples
};

float stiffening_of(const LumpedBody& body) {
  return body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F;
}

/// From how far a spring's ends move apart to what it pulls with beyond the linear force, all samples side by side.
template <typename Samples>
void pull_beyond_linear(const Element& element, float stiffening, const Eigen::Vector3f& d, Samples x, Samples y, Samples z) {
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

/// The springs of a body at the samples.
class BentSprings {
 public:
  BentSprings(const Linearisation& at, const Matrix& moved, const Matrix& u)
      : at_(&at), moved_(moved.cast<float>()), way_(u.cast<float>()) {
    // |G u| over all samples is |G L|, L L^T = u u^T: fewer columns.
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(u * u.transpose());
    const Matrix root = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
    elements_ = elements_that_bend(*at.dynamics, *at.state, moved * root, kNegligible);
  }
  const std::vector<std::uint32_t>& elements() const { return elements_; }
  bool have_length() const {
    return std::all_of(elements_.begin(), elements_.end(), [&](std::uint32_t e) { return span(e).norm() > kLengthMin; });
  }
  /// d
  Vec3 span(std::uint32_t element) const {
    const Element& e = body().elements[element];
    return at_node(at_->state->x, e.b) - at_node(at_->state->x, e.a);
  }
  void bend(std::span<const std::uint32_t> elements, Bending& b) const {
    const auto count = static_cast<Eigen::Index>(elements.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      b.motion[axis].resize(count, moved_.cols());
      for (Eigen::Index k = 0; k < count; ++k) {
        const Element& e = body().elements[elements[static_cast<std::size_t>(k)]];
        const auto row = [&](std::uint32_t node) {
          return moved_.row(3 * static_cast<Eigen::Index>(node) + static_cast<Eigen::Index>(axis));
        };
        b.motion[axis].row(k) = row(e.b) - row(e.a);
      }
      b.force[axis].noalias() = b.motion[axis] * way_;
    }
    const float stiffening = stiffening_of(body());
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::uint32_t e = elements[static_cast<std::size_t>(k)];
      pull_beyond_linear(body().elements[e], stiffening, span(e).cast<float>(), b.force[0].row(k).array(),
                         b.force[1].row(k).array(), b.force[2].row(k).array());
    }
  }
  const LumpedBody& body() const { return at_->dynamics->body(); }

 private:
  const Linearisation* at_;
  Rows moved_;
  Eigen::MatrixXf way_;
  std::vector<std::uint32_t> elements_;
};

/// All springs together, and those with the largest forces times motions.
struct Survey {
  Eigen::MatrixXf all;  ///< sum of G_e^T r_e, n x samples
  std::vector<std::uint32_t> largest;
};

/// Some springs at a time: they stay near the processor.
Survey survey(const BentSprings& springs, Eigen::Index variables, Eigen::Index samples) {
  constexpr std::size_t kTogether = 128;
  const std::vector<std::uint32_t>& elements = springs.elements();
  Survey found{Eigen::MatrixXf::Zero(variables, samples), {}};
  Eigen::VectorXf part(static_cast<Eigen::Index>(elements.size()));
  Bending b;
  for (std::size_t begin = 0; begin < elements.size(); begin += kTogether) {
    const std::size_t count = std::min(kTogether, elements.size() - begin);
    springs.bend(std::span(elements).subspan(begin, count), b);
    Eigen::VectorXf pushes = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(count)), moves = pushes;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      found.all.noalias() += b.motion[axis].transpose() * b.force[axis];
      pushes += b.force[axis].rowwise().squaredNorm();
      moves += b.motion[axis].rowwise().squaredNorm();
    }
    part.segment(static_cast<Eigen::Index>(begin), pushes.size()) = pushes.cwiseProduct(moves);
  }
  std::vector<Eigen::Index> order(elements.size()), rows(std::min<std::size_t>(elements.size(), kCandidates));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::partial_sort_copy(order.begin(), order.end(), rows.begin(), rows.end(),
                         [&](Eigen::Index i, Eigen::Index j) { return part[i] != part[j] ? part[i] > part[j] : i < j; });
  for (const Eigen::Index row : rows) found.largest.push_back(elements[static_cast<std::size_t>(row)]);
  return found;
}

/// Some of the candidates with their weights.
SampledSprings chosen(const BentSprings& all, const std::vector<std::uint32_t>& candidates, const Bending& b,
                      const SparseWeights& w) {
  SampledSprings springs;
  const auto count = static_cast<Eigen::Index>(w.columns.size());
  springs.stiffening = stiffening_of(all.body());
  springs.motion.resize(3 * count, b.motion[0].cols());
  springs.span.resize(3, count);
  springs.rest_length.resize(count);
  springs.stiffness.resize(count);
  springs.damping.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index row = w.columns[static_cast<std::size_t>(k)];
    const std::uint32_t element = candidates[static_cast<std::size_t>(row)];
    const Element& e = all.body().elements[element];
    for (int axis = 0; axis < 3; ++axis) springs.motion.row(3 * k + axis) = b.motion[static_cast<std::size_t>(axis)].row(row);
    springs.span.col(k) = all.span(element).cast<float>();
    springs.rest_length[k] = static_cast<float>(e.rest_length_m);
    springs.stiffness[k] = w.weights[k] * static_cast<float>(e.stiffness_n_m);
    springs.damping[k] = w.weights[k] * static_cast<float>(e.damping_n_s_m);
  }
  return springs;
}

/// Sums of samples, orthogonal: some frequencies of a cosine transform of samples with signs drawn by chance. Least squares over
/// all samples are nearly those over a few such sums (Woodruff, FnTTCS 10 (2014), chapter 2).
Eigen::MatrixXf mixing(Eigen::Index samples) {
  Random random(2);
  Eigen::MatrixXf mix(samples, kMixed);
  for (Eigen::Index s = 0; s < samples; ++s) {
    const double sign = random.chance(0.5) ? 1 : -1;
    for (Eigen::Index j = 0; j < kMixed; ++j) {
      const auto frequency = static_cast<double>(j * samples / kMixed);
      const double wave = std::cos(M_PI * (static_cast<double>(s) + 0.5) * frequency / static_cast<double>(samples));
      mix(s, j) = static_cast<float>(sign * (j == 0 ? std::sqrt(0.5) : wave));
    }
  }
  return mix;
}

/// Bending as forces on the variables, in units in which every sample counts alike.
struct Fit {
  Eigen::MatrixXf parts;  ///< of each candidate, a column each: n x sums of samples
  Eigen::VectorXf all;    ///< of all springs
};

Fit fit_of(const Bending& candidates, Eigen::MatrixXf all, const Matrix& u, const Vector& stiffness) {
  const Eigen::VectorXf unit = stiffness.cwiseSqrt().cwiseInverse().cast<float>();
  const Eigen::Index n = u.rows(), count = candidates.motion[0].rows();
  all = unit.asDiagonal() * all;
  const Eigen::MatrixXf linear = unit.cwiseInverse().asDiagonal() * u.cast<float>();
  const Eigen::VectorXf size =
      (all.colwise().norm() + static_cast<float>(kOfLinear) * linear.colwise().norm()).cwiseMax(1e-30F).transpose();
  const Eigen::MatrixXf mix = size.cwiseInverse().asDiagonal() * mixing(u.cols());
  Fit fit;
  fit.all = (all * mix).reshaped();
  fit.parts.setZero(n * kMixed, count);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Rows mixed = candidates.force[axis] * mix, moved = candidates.motion[axis] * unit.asDiagonal();
    for (Eigen::Index k = 0; k < count; ++k) {
      float* to = fit.parts.col(k).data();
      for (Eigen::Index j = 0; j < kMixed; ++j)
        for (Eigen::Index i = 0; i < n; ++i) *to++ += mixed(k, j) * moved(k, i);
    }
  }
  return fit;
}

}  // namespace

std::optional<SampledSprings> sample_springs(const Linearisation& at, const Matrix& moved, const SpringSampling& sampling) {
  const Matrix u = samples(sampling);
  const BentSprings springs(at, moved, u);
  if (springs.elements().empty() || !springs.have_length()) return std::nullopt;
  Survey found = survey(springs, u.rows(), u.cols());
  Bending candidates;
  springs.bend(found.largest, candidates);
  const Fit fit = fit_of(candidates, std::move(found.all), u, sampling.stiffness);
  const SparseWeights w = sparse_weights(fit.parts, fit.all, sampling.springs, kCloseEnough);
  if (w.columns.empty()) return std::nullopt;
  return chosen(springs, found.largest, candidates, w);
}

}  // namespace palpate
