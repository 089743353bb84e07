#include "server/reduce/sample_springs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "server/reduce/expansion.hpp"

namespace palpate {
namespace {

constexpr std::size_t kCandidates = 600;
constexpr double kNegligible = 1e-5;  // of the bending, in springs that are not looked at
constexpr double kLengthMin = 1e-9;   // below, a spring has no direction [m]

/// Megabytes that would be asked of the system anew for every patch.
struct Workspace {
  AtSamples there, forces;
};

Workspace& workspace() {
  thread_local Workspace room;
  return room;
}

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
    elements_ = elements_that_bend(*at.dynamics, *at.state, moved * root_of(u), kNegligible);
  }
  const std::vector<std::uint32_t>& elements() const { return elements_; }
  bool have_length() const {
    return std::all_of(elements_.begin(), elements_.end(), [&](std::uint32_t e) { return span(e).norm() > kLengthMin; });
  }
  const LumpedBody& body() const { return at_->dynamics->body(); }
  const Vector& positions() const { return at_->state->x; }
  const Rows& moved() const { return moved_; }
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
    Bending b{std::vector<Rows>(3), std::vector<AtSamples>(3)};
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

std::vector<std::uint32_t> nodes_of(const LumpedBody& body, const std::vector<std::uint32_t>& springs) {
  std::vector<std::uint32_t> nodes;
  for (const std::uint32_t e : springs) nodes.insert(nodes.end(), {body.elements[e].a, body.elements[e].b});
  return nodes;
}

/// The springs themselves, without weights; their nodes' motions as they travel.
SampledSprings taken(const BentSprings& all, const std::vector<std::uint32_t>& elements, int tool) {
  const LumpedBody& body = all.body();
  MetNodes met;
  const auto count = static_cast<Eigen::Index>(elements.size());
  SampledSprings springs;
  springs.stiffening = stiffening_of(body);
  springs.ends.resize(2, count);
  springs.rest_length.resize(count);
  springs.stiffness.resize(count);
  springs.damping.resize(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Element& e = body.elements[elements[static_cast<std::size_t>(k)]];
    const int a = met.number_of(e.a), b = met.number_of(e.b);
    springs.ends.col(k) << a, b;
    springs.rest_length[k] = static_cast<float>(e.rest_length_m);
    springs.stiffness[k] = static_cast<float>(e.stiffness_n_m);
    springs.damping[k] = static_cast<float>(e.damping_n_s_m);
  }
  springs.position = met.places(all.positions());
  springs.motion = met.motion(all.moved(), tool, body.planar ? 2 : 3);
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

/// G of some springs, 3 rows each.
Eigen::MatrixXf motions_of(const BentSprings& springs, const std::vector<std::uint32_t>& elements) {
  Eigen::MatrixXf g(3 * static_cast<Eigen::Index>(elements.size()), springs.rows_of(0).cols());
  for (std::size_t k = 0; k < elements.size(); ++k)
    g.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = springs.motion_of(elements[k]);
  return g;
}

}  // namespace

std::optional<SampledSprings> sample_springs(const Linearisation& at, const Matrix& moved, const Sampling& sampling) {
  const Matrix u = samples(sampling);
  const BentSprings springs(at, moved, u);
  if (springs.elements().empty() || !springs.have_length()) return std::nullopt;
  Eigen::VectorXf parts;
  const Fit fit(springs.all_together(parts), u, sampling.stiffness);
  const std::vector<std::uint32_t> candidates = largest(springs.elements(), parts, kCandidates);
  NodePrices prices(nodes_of(springs.body(), candidates), 2, springs.body().nodes.size(),
                    [&](int nodes, int count) { return numbers_of_springs(sampling.room, nodes, count); });
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
