#include "server/reduce/sample_springs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <unordered_map>

#include "common/base/random.hpp"
#include "server/reduce/expansion.hpp"
#include "server/reduce/sparse_weights.hpp"

namespace palpate {
namespace {

constexpr int kSamples = 72, kMixed = 32, kAlone = 3, kAround = 12, kCandidates = 600;
constexpr double kLengthMin = 1e-9;    // below, a spring has no direction [m]
constexpr double kNegligible = 1e-5;   // of the bending, in springs that are not looked at
constexpr float kCloseEnough = 3e-3F;  // of all samples together

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using AtSamples = Eigen::Matrix<float, Eigen::Dynamic, kSamples, Eigen::RowMajor>;

/// Megabytes that would be asked of the system anew for every patch.
struct Workspace {
  AtSamples there, forces;
  Eigen::MatrixXf parts;
};

Workspace& workspace() {
  thread_local Workspace room;
  return room;
}

/// u_s, a column each.
Matrix samples(const SpringSampling& sampling) {
  constexpr double kFar = 1.5, kLittle = 0.3;
  const Matrix &likely = sampling.likely, &path = sampling.path;
  Random random(1);
  const auto draw = [&] { return random.uniform(-1, 1); };
  Matrix u(likely.rows(), kSamples);
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
  std::array<AtSamples, 3> force;
};

float stiffening_of(const LumpedBody& body) {
  return body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F;
}

/// From how far a spring's ends move apart to what it pulls with beyond the linear force, all samples side by side.
template <typename Samples>
void pull_beyond_linear(const Element& element, float stiffening, const Eigen::Vector3f& d, Samples x, Samples y, Samples z) {
  using Each = Eigen::Array<float, 1, kSamples, Eigen::RowMajor>;
  const auto k = static_cast<float>(element.stiffness_n_m), rest = static_cast<float>(element.rest_length_m);
  const float length = d.norm(), strain = (length - rest) / rest;
  const float tension = k * rest * strain * (1 + stiffening * strain * strain), across = tension / length;
  const float along = k * (1 + 3 * stiffening * strain * strain) - across;
  const Eigen::Vector3f n = d / length;
  const Each now =
      ((x + d.x()).square() + (y + d.y()).square() + (z + d.z()).square()).sqrt().max(static_cast<float>(kLengthMin));
  Each pull = k - (k * rest) / now;  // over the length
  if (stiffening > 0) pull *= 1 + stiffening * ((now - rest) / rest).square();
  const Each turned = tension + along * (n.x() * x + n.y() * y + n.z() * z);
  pull -= across;
  x = pull * x + (pull + across) * d.x() - turned * n.x();
  y = pull * y + (pull + across) * d.y() - turned * n.y();
  z = pull * z + (pull + across) * d.z() - turned * n.z();
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
  const LumpedBody& body() const { return at_->dynamics->body(); }
  Vec3 place_of(std::uint32_t node) const { return at_node(at_->state->x, node); }
  /// d
  Vec3 span(std::uint32_t element) const {
    const Element& e = body().elements[element];
    return place_of(e.b) - place_of(e.a);
  }
  /// V of a node.
  auto rows_of(std::uint32_t node) const { return moved_.middleRows<3>(3 * static_cast<Eigen::Index>(node)); }
  /// G of a spring.
  Eigen::Matrix3Xf motion_of(std::uint32_t element) const {
    const Element& e = body().elements[element];
    return rows_of(e.b) - rows_of(e.a);
  }
  /// With G as given, 3 rows a spring.
  Bending bend(std::span<const std::uint32_t> elements, const Eigen::MatrixXf& motions) const {
    Bending b;
    const auto count = static_cast<Eigen::Index>(elements.size());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Rows& motion = b.motion[static_cast<std::size_t>(axis)];
      motion = motions(Eigen::seqN(axis, count, 3), Eigen::all);
      b.force[static_cast<std::size_t>(axis)].noalias() = motion * way_;
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::uint32_t e = elements[static_cast<std::size_t>(k)];
      pull_beyond_linear(body().elements[e], stiffening_of(body()), span(e).cast<float>(), b.force[0].row(k).array(),
                         b.force[1].row(k).array(), b.force[2].row(k).array());
    }
    return b;
  }
  /// What all springs together add to the forces on nodes, as forces on the variables, n x samples; and of each |r| |G|.
  Eigen::MatrixXf all_together(Eigen::VectorXf& parts) const {
    AtSamples &there = workspace().there, &forces = workspace().forces;
    there.noalias() = moved_ * way_;
    forces.setZero(there.rows(), kSamples);
    Eigen::Matrix<float, 3, kSamples, Eigen::RowMajor> r;
    parts.resize(static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = body().elements[elements_[k]];
      const auto a = 3 * static_cast<Eigen::Index>(e.a), b = 3 * static_cast<Eigen::Index>(e.b);
      r = there.middleRows<3>(b) - there.middleRows<3>(a);
      pull_beyond_linear(e, stiffening_of(body()), span(elements_[k]).cast<float>(), r.row(0).array(), r.row(1).array(),
                         r.row(2).array());
      forces.middleRows<3>(a) -= r;
      forces.middleRows<3>(b) += r;
      parts[static_cast<Eigen::Index>(k)] = r.norm() * (rows_of(e.b) - rows_of(e.a)).norm();
    }
    return moved_.transpose() * forces;
  }

 private:
  const Linearisation* at_;
  Rows moved_;
  Eigen::MatrixXf way_;
  std::vector<std::uint32_t> elements_;
};

/// The candidates: those with the largest forces times motions.
std::vector<std::uint32_t> largest(const std::vector<std::uint32_t>& elements, const Eigen::VectorXf& parts) {
  std::vector<Eigen::Index> order(elements.size()), rows(std::min<std::size_t>(elements.size(), kCandidates));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::partial_sort_copy(order.begin(), order.end(), rows.begin(), rows.end(),
                         [&](Eigen::Index i, Eigen::Index j) { return parts[i] != parts[j] ? parts[i] > parts[j] : i < j; });
  std::vector<std::uint32_t> found;
  for (const Eigen::Index row : rows) found.push_back(elements[static_cast<std::size_t>(row)]);
  return found;
}

/// Numbers that springs take on their way: few where their nodes are there already.
class SpringPrices : public ColumnPrices {
 public:
  SpringPrices(const TermsRoom& room, const LumpedBody& body, const std::vector<std::uint32_t>& candidates)
      : room_(room), body_(&body), candidates_(&candidates), used_(body.nodes.size(), 0) {}
  void with(const std::vector<Eigen::Index>& there) override {
    std::fill(used_.begin(), used_.end(), std::uint8_t{0});
    nodes_ = 0;
    for (const Eigen::Index column : there) {
      nodes_ += new_nodes(column);
      used_[spring(column).a] = used_[spring(column).b] = 1;
    }
    const auto springs = static_cast<int>(there.size());
    const int now = numbers_of_springs(room_, nodes_, springs);
    for (int more = 0; more <= 2; ++more) {
      const int then = numbers_of_springs(room_, nodes_ + more, springs + 1);
      const bool fits = then <= kUsualNumbers && nodes_ + more <= kMaxSpringNodes;
      price_[static_cast<std::size_t>(more)] = fits ? static_cast<float>(then - now) : std::numeric_limits<float>::infinity();
    }
  }
  float of(Eigen::Index column) const override { return price_[static_cast<std::size_t>(new_nodes(column))]; }

 private:
  const Element& spring(Eigen::Index column) const { return body_->elements[(*candidates_)[static_cast<std::size_t>(column)]]; }
  int new_nodes(Eigen::Index column) const { return 2 - used_[spring(column).a] - used_[spring(column).b]; }
  TermsRoom room_;
  const LumpedBody* body_;
  const std::vector<std::uint32_t>* candidates_;
  std::vector<std::uint8_t> used_;
  int nodes_ = 0;
  std::array<float, 3> price_{};  // with so many new nodes
};

/// The springs themselves, without weights; their nodes' motions as they travel.
SampledSprings taken(const BentSprings& all, const std::vector<std::uint32_t>& elements, int tool) {
  const LumpedBody& body = all.body();
  std::vector<std::uint32_t> nodes;
  std::unordered_map<std::uint32_t, int> number;
  const auto number_of = [&](std::uint32_t node) {
    const auto [known, is_new] = number.try_emplace(node, static_cast<int>(nodes.size()));
    if (is_new) nodes.push_back(node);
    return known->second;
  };
  const auto count = static_cast<Eigen::Index>(elements.size());
  SampledSprings springs;
  springs.stiffening = stiffening_of(body);
  springs.ends.resize(2, count);
  springs.rest_length.resize(count);
  springs.stiffness.resize(count);
  springs.damping.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Element& e = body.elements[elements[static_cast<std::size_t>(k)]];
    springs.ends.col(k) << number_of(e.a), number_of(e.b);
    springs.rest_length[k] = static_cast<float>(e.rest_length_m);
    springs.stiffness[k] = static_cast<float>(e.stiffness_n_m);
    springs.damping[k] = static_cast<float>(e.damping_n_s_m);
  }
  const Eigen::Index modes = all.rows_of(0).cols() - (tool < 0 ? 0 : 3);
  Eigen::MatrixXf rows(3 * static_cast<Eigen::Index>(nodes.size()), modes);
  springs.position.resize(3, static_cast<Eigen::Index>(nodes.size()));
  const Vec3 origin = all.place_of(nodes.front());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = all.rows_of(nodes[i]).rightCols(modes);
    springs.position.col(static_cast<Eigen::Index>(i)) = (all.place_of(nodes[i]) - origin).cast<float>();
  }
  const auto held = tool < 0 ? number.end() : number.find(static_cast<std::uint32_t>(tool));
  springs.motion = rounded(rows, held == number.end() ? -1 : held->second);
  springs.motion.tool_axes = body.planar ? 2 : 3;
  return springs;
}

/// Those of some springs that have weights, with them.
SampledSprings weighed(SampledSprings springs, const SparseWeights& w) {
  const auto of = [&](const Eigen::VectorXf& v) { return Eigen::VectorXf(v(w.columns)); };
  springs.ends = Eigen::Matrix2Xi(springs.ends(Eigen::all, w.columns));
  springs.rest_length = of(springs.rest_length);
  springs.stiffness = of(springs.stiffness).cwiseProduct(w.weights);
  springs.damping = of(springs.damping).cwiseProduct(w.weights);
  return springs;
}

/// Sums of samples, orthogonal: some frequencies of a cosine transform of samples with signs drawn by chance. Least squares over
/// all samples are nearly those over a few such sums (Woodruff, FnTTCS 10 (2014), chapter 2).
Eigen::MatrixXf make_mixing() {
  Random random(2);
  Eigen::MatrixXf mix(kSamples, kMixed);
  for (Eigen::Index s = 0; s < kSamples; ++s) {
    const double sign = random.chance(0.5) ? 1 : -1;
    for (Eigen::Index j = 0; j < kMixed; ++j) {
      const auto frequency = static_cast<double>(j * kSamples / kMixed);
      const double wave = std::cos(M_PI * (static_cast<double>(s) + 0.5) * frequency / kSamples);
      mix(s, j) = static_cast<float>(sign * (j == 0 ? std::sqrt(0.5) : wave));
    }
  }
  return mix;
}

const Eigen::MatrixXf& mixing() {
  static const Eigen::MatrixXf mix = make_mixing();
  return mix;
}

/// Forces on the variables at sums of samples, in units in which every sample counts alike.
class Fit {
 public:
  /// `all`: of all springs together.
  Fit(const Eigen::MatrixXf& all, const Matrix& u, const Vector& stiffness)
      : unit_(stiffness.cwiseSqrt().cwiseInverse().cast<float>()) {
    const Eigen::MatrixXf bent = unit_.asDiagonal() * all, linear = unit_.cwiseInverse().asDiagonal() * u.cast<float>();
    const Eigen::VectorXf size =
        (bent.colwise().norm() + static_cast<float>(kOfLinear) * linear.colwise().norm()).cwiseMax(1e-30F).transpose();
    mix_ = size.cwiseInverse().asDiagonal() * mixing();
    all_ = (bent * mix_).reshaped();
  }
  const Eigen::VectorXf& all() const { return all_; }
  /// Of each spring, a column each; until they are asked for again.
  const Eigen::MatrixXf& parts(const Bending& springs) const {
    const Eigen::Index n = unit_.size(), count = springs.motion[0].rows();
    Eigen::MatrixXf& parts = workspace().parts;
    parts.setZero(n * kMixed, count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Rows mixed = springs.force[axis] * mix_, moved = springs.motion[axis] * unit_.asDiagonal();
      for (Eigen::Index k = 0; k < count; ++k) {
        float* to = parts.col(k).data();
        for (Eigen::Index j = 0; j < kMixed; ++j)
          for (Eigen::Index i = 0; i < n; ++i) *to++ += mixed(k, j) * moved(k, i);
      }
    }
    return parts;
  }

 private:
  Eigen::VectorXf unit_, all_;
  Eigen::MatrixXf mix_;
};

/// G of some springs, 3 rows each.
Eigen::MatrixXf motions_of(const BentSprings& springs, const std::vector<std::uint32_t>& elements) {
  Eigen::MatrixXf g(3 * static_cast<Eigen::Index>(elements.size()), springs.rows_of(0).cols());
  for (std::size_t k = 0; k < elements.size(); ++k)
    g.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = springs.motion_of(elements[k]);
  return g;
}

}  // namespace

std::optional<SampledSprings> sample_springs(const Linearisation& at, const Matrix& moved, const SpringSampling& sampling) {
  const Matrix u = samples(sampling);
  const BentSprings springs(at, moved, u);
  if (springs.elements().empty() || !springs.have_length()) return std::nullopt;
  Eigen::VectorXf parts;
  const Fit fit(springs.all_together(parts), u, sampling.stiffness);
  const std::vector<std::uint32_t> candidates = largest(springs.elements(), parts);
  SpringPrices prices(sampling.room, springs.body(), candidates);
  const SparseWeights few = sparse_weights(fit.parts(springs.bend(candidates, motions_of(springs, candidates))), fit.all(),
                                           kMaxSprings, kCloseEnough, prices);
  if (few.columns.empty()) return std::nullopt;
  std::vector<std::uint32_t> elements;
  for (const Eigen::Index column : few.columns) elements.push_back(candidates[static_cast<std::size_t>(column)]);
  SampledSprings chosen = taken(springs, elements, sampling.tool);
  const Bending as_sent = springs.bend(elements, chosen.motions(sampling.tool < 0 ? 0 : 3));
  const SparseWeights w = positive_weights(fit.parts(as_sent), fit.all());
  if (w.columns.empty()) return std::nullopt;
  return weighed(std::move(chosen), w);
}

}  // namespace palpate
