#include "server/reduce/sample_springs.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <span>

#include "server/elements/fused.hpp"
#include "server/reduce/nonlinear_elements.hpp"

namespace palpate {
namespace {

constexpr double kNegligibleSprings = 1e-5;  // share of the nonlinearity left out: 1e-6 gains nothing (docs/notebook.md, 27)
// Bounds of the slope of a stiffening law, relative to rest; tuned: mass slows steeper springs (docs/notebook.md, 35).
constexpr double kSlopeLeast = 4, kSlopeMost = 100;

/// Megabytes of work space, reused instead of allocated for every patch.
struct Workspace {
  SampleMatrix there, forces;
};

Workspace& workspace() {
  thread_local Workspace workspace;
  return workspace;
}

float stiffening_of(const LumpedBody& body) {
  return body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F;
}

constexpr int kLane = 8;  // samples side by side: floats of a 256-bit register
static_assert(kSamples % kLane == 0);
using Lane = EightFloats;

/// Eight numbers of a row with one per sample.
[[gnu::always_inline]] inline Lane& lane(float* row, Eigen::Index first) { return *reinterpret_cast<Lane*>(row + first); }

/// Computes l and 1 / l from the square of l.
[[gnu::always_inline]] inline void length_of(const Lane& square, Lane& length, Lane& inverse) {
  alignas(sizeof(Lane)) float numbers[kLane];
  lane(numbers, 0) = square;
  Eigen::Map<Eigen::Array<float, kLane, 1>, Eigen::Aligned32> root(numbers);
  root = root.sqrt().max(static_cast<float>(kElementLengthMinM));
  length = lane(numbers, 0);
  inverse = 1.0F / length;
}

/// The force of a spring beyond its linear one.
class NonlinearResidualForce {
 public:
  /// `d`: vector between its ends.
  NonlinearResidualForce(const Element& element, float stiffening, const Eigen::Vector3f& d)
      : d_(d),
        k_(static_cast<float>(element.stiffness_n_m)),
        rest_(static_cast<float>(element.rest_length_m)),
        stiffening_(stiffening) {
    const float length = d.norm(), strain = (length - rest_) / rest_;
    n_ = d / length;
    tension_ = k_ * rest_ * strain * (1 + stiffening * strain * strain);
    across_ = tension_ / length;
    along_ = k_ * (1 + 3 * stiffening * strain * strain) - across_;
  }
  /// Replaces the relative displacement of the ends by the force.
  [[gnu::always_inline]] void operator()(Lane& x, Lane& y, Lane& z) const {
    const Lane now_x = x + d_.x(), now_y = y + d_.y(), now_z = z + d_.z();
    Lane square = now_x * now_x, length, inverse;
    add_product(now_y, now_y, square), add_product(now_z, now_z, square);
    length_of(square, length, inverse);
    Lane pull = k_ - (k_ * rest_) * inverse;  // force over length
    if (stiffening_ > 0) {
      const Lane strain = (length - rest_) * (1 / rest_);
      pull *= 1 + stiffening_ * strain * strain;
    }
    Lane along = n_.x() * x;
    add_product(n_.y(), y, along), add_product(n_.z(), z, along);
    const Lane turned = -tension_ - along_ * along, more = pull - across_;
    x *= more, y *= more, z *= more;
    add_product(d_.x(), pull, x), add_product(d_.y(), pull, y), add_product(d_.z(), pull, z);
    add_product(n_.x(), turned, x), add_product(n_.y(), turned, y), add_product(n_.z(), turned, z);
  }

 private:
  Eigen::Vector3f d_, n_;
  float k_, rest_, stiffening_, tension_ = 0, across_ = 0, along_ = 0;
};

[[gnu::always_inline]] inline float sum_of(const Lane& numbers) {
  float sum = 0;
  for (int i = 0; i < kLane; ++i) sum += numbers[i];
  return sum;
}

/// The springs of a body at the samples.
class CandidateSprings {
 public:
  using Sample = SampledSprings;
  // Measured: 2,000 cost the organ 1.5 dB, 400 `softcore6` 2 to 4 dB (docs/notebook.md, 30, 41); more take longer.
  static constexpr std::size_t kEvaluatedElementsMax = 5000, kCandidatesMax = 600;
  static constexpr int kElementNodes = 2, kChosenMax = kMaxSprings;  // its ends; capacity of the wire

  CandidateSprings(const WholeBody& body, const Matrix& moved, const Matrix& u)
      : at_(&body), moved_(moved.cast<float>()), samples_(u.cast<float>()) {
    assert(moved.rows() == body.state().x.size() && moved.cols() == u.rows() && u.cols() == kSamples);
    elements_ = nonlinear_elements(body.dynamics(), body.state(), moved * root_of(u), kNegligibleSprings, kEvaluatedElementsMax);
  }
  const std::vector<std::uint32_t>& elements() const { return elements_; }
  bool have_length() const {
    return std::all_of(elements_.begin(), elements_.end(), [&](std::uint32_t e) { return span(e).norm() > kElementLengthMinM; });
  }
  const LumpedBody& body() const { return at_->dynamics().body(); }
  std::size_t nodes() const { return body().nodes.size(); }
  std::uint32_t node(std::uint32_t element, int end) const {
    const Element& e = body().elements[element];
    return end == 0 ? e.a : e.b;
  }
  Vec3 place_of(std::uint32_t node) const { return at_node(at_->state().x, node); }
  /// Returns d.
  Vec3 span(std::uint32_t element) const {
    const Element& e = body().elements[element];
    return place_of(e.b) - place_of(e.a);
  }
  /// Returns V of a node.
  auto rows_of(std::uint32_t node) const { return moved_.middleRows<3>(3 * static_cast<Eigen::Index>(node)); }
  /// Returns G of a spring.
  Eigen::Matrix3Xf motion_of(std::uint32_t element) const {
    const Element& e = body().elements[element];
    return rows_of(e.b) - rows_of(e.a);
  }
  /// Returns G of some springs, 3 rows each.
  Eigen::MatrixXf motions(const std::vector<std::uint32_t>& elements) const {
    Eigen::MatrixXf g(3 * static_cast<Eigen::Index>(elements.size()), moved_.cols());
    for (std::size_t k = 0; k < elements.size(); ++k) g.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = motion_of(elements[k]);
    return g;
  }
  /// Returns the forces of springs with given G, 3 rows each.
  ElementForces forces_of(std::span<const std::uint32_t> elements, const Eigen::MatrixXf& motions) const {
    assert(motions.rows() == 3 * static_cast<Eigen::Index>(elements.size()) && motions.cols() == samples_.rows());
    ElementForces b{std::vector<Rows>(3), std::vector<SampleMatrix>(3)};
    const auto count = static_cast<Eigen::Index>(elements.size());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Rows& motion = b.motion[static_cast<std::size_t>(axis)];
      motion = motions(Eigen::seqN(axis, count, 3), Eigen::all);
      b.force[static_cast<std::size_t>(axis)].noalias() = motion * samples_;
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::uint32_t e = elements[static_cast<std::size_t>(k)];
      const NonlinearResidualForce pull = pull_of(e);
      float *const x = b.force[0].row(k).data(), *const y = b.force[1].row(k).data(), *const z = b.force[2].row(k).data();
      for (Eigen::Index first = 0; first < kSamples; first += kLane) {
        Lane rx = lane(x, first), ry = lane(y, first), rz = lane(z, first);
        pull(rx, ry, rz);
        lane(x, first) = rx;
        lane(y, first) = ry;
        lane(z, first) = rz;
      }
    }
    return b;
  }
  /// Returns the nonlinear forces of all springs on the nodes, as forces on the variables, n x samples; `parts`: |r| |G| of each.
  Eigen::MatrixXf all_together(Eigen::VectorXf& parts) const {
    SampleMatrix &there = workspace().there, &forces = workspace().forces;
    there.noalias() = moved_ * samples_;
    forces.setZero(there.rows(), kSamples);
    float *const from = there.data(), *const to = forces.data();
    parts.resize(static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = body().elements[elements_[k]];
      const NonlinearResidualForce pull = pull_of(elements_[k]);
      const auto a = 3 * kSamples * static_cast<Eigen::Index>(e.a), b = 3 * kSamples * static_cast<Eigen::Index>(e.b);
      Lane square{};
      for (Eigen::Index first = 0; first < kSamples; first += kLane) {
        const Eigen::Index x = first, y = first + kSamples, z = first + 2 * kSamples;
        Lane rx = lane(from + b, x) - lane(from + a, x), ry = lane(from + b, y) - lane(from + a, y),
             rz = lane(from + b, z) - lane(from + a, z);
        pull(rx, ry, rz);
        lane(to + a, x) -= rx;
        lane(to + a, y) -= ry;
        lane(to + a, z) -= rz;
        lane(to + b, x) += rx;
        lane(to + b, y) += ry;
        lane(to + b, z) += rz;
        add_product(rx, rx, square), add_product(ry, ry, square), add_product(rz, rz, square);
      }
      parts[static_cast<Eigen::Index>(k)] = std::sqrt(sum_of(square)) * (rows_of(e.b) - rows_of(e.a)).norm();
    }
    return moved_.transpose() * forces;
  }

  /// Returns the springs themselves, without weights, with their nodes' motions as sent.
  SampledSprings taken(const std::vector<std::uint32_t>& elements, int tool) const {
    NodeNumbering met;
    const auto count = static_cast<Eigen::Index>(elements.size());
    SampledSprings springs;
    springs.stiffening = stiffening_of(body());
    springs.ends.resize(2, count);
    springs.rest_length.resize(count);
    springs.stiffness.resize(count);
    springs.damping.resize(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Element& e = body().elements[elements[static_cast<std::size_t>(k)]];
      const int a = met.number_of(e.a), b = met.number_of(e.b);
      springs.ends.col(k) << a, b;
      springs.rest_length[k] = static_cast<float>(e.rest_length_m);
      springs.stiffness[k] = static_cast<float>(e.stiffness_n_m);
      springs.damping[k] = static_cast<float>(e.damping_n_s_m);
    }
    springs.position = met.places(at_->state().x);
    springs.motion = met.motion(moved_, tool, body().planar ? 2 : 3);
    return springs;
  }
  /// Returns the springs that have weights, with these.
  static SampledSprings weighed(SampledSprings springs, const SparseSolution& w) {
    assert(w.weights.size() > 0 && w.weights.minCoeff() > 0);
    const auto of = [&](const Eigen::VectorXf& v) { return Eigen::VectorXf(v(w.columns)); };
    springs.ends = Eigen::Matrix2Xi(springs.ends(Eigen::all, w.columns));
    springs.rest_length = of(springs.rest_length);
    springs.stiffness = of(springs.stiffness).cwiseProduct(w.weights);
    springs.damping = of(springs.damping).cwiseProduct(w.weights);
    return springs;
  }

 private:
  NonlinearResidualForce pull_of(std::uint32_t element) const {
    return {body().elements[element], stiffening_of(body()), span(element).cast<float>()};
  }
  const WholeBody* at_;
  Rows moved_;
  Eigen::MatrixXf samples_;
  std::vector<std::uint32_t> elements_;
};

/// Returns the steepest slope that each spring reaches, relative to rest, in responses of the body as large as they are likely to
/// become, in both directions. Samples go further, but the assumed stiffness costs mass (sampled_springs.hpp).
Eigen::ArrayXd steepest_slopes(const SampledSprings& springs, const Matrix& likely, int tool) {
  assert(springs.stiffening > 0 && springs.rest_length.minCoeff() > 0);
  const Eigen::MatrixXf moved = springs.motions(tool) * likely.cast<float>();
  const Eigen::Matrix3Xf spans = springs.spans();
  Eigen::ArrayXd slopes(springs.count());
  for (Eigen::Index e = 0; e < slopes.size(); ++e) {
    const auto from = spans.col(e);
    const auto displacements = moved.middleRows<3>(3 * e);
    const float rest = springs.rest_length[e];
    const auto largest = [&](const auto& lengths) { return (lengths.array() / rest - 1).abs().maxCoeff(); };
    const float strain = std::max({std::abs(from.norm() / rest - 1), largest((displacements.colwise() + from).colwise().norm()),
                                   largest((displacements.colwise() - from).colwise().norm())});
    slopes[e] = 1 + 3 * static_cast<double>(springs.stiffening * strain * strain);
  }
  return slopes.max(kSlopeLeast).min(kSlopeMost);
}

}  // namespace

std::optional<SampledSprings> sample_springs(const WholeBody& body, const Matrix& moved, const Sampling& sampling) {
  const Matrix u = samples(sampling);
  const CandidateSprings springs(body, moved, u);
  if (springs.elements().empty() || !springs.have_length()) return std::nullopt;
  auto found = sample(springs, u, sampling);
  if (found && found->stiffening > 0)
    found->max_slope = SampledSprings::steep_of(steepest_slopes(*found, sampling.likely, sampling.tool < 0 ? 0 : 3));
  return found;
}

}  // namespace palpate
