#include "server/reduction/sample_elements.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/mechanics/residual.hpp"
#include "common/patch/sampled_springs.hpp"
#include "server/sampling/element_gradient.hpp"
#include "server/sampling/gradient_points.hpp"
#include "server/sampling/nonlinear_elements.hpp"
#include "server/solve/fused.hpp"

namespace palpate {
namespace {

constexpr double kNegligibleSprings = 1e-5;  // share of the nonlinearity left out: 1e-6 gains nothing (docs/notebook.md, 27)
constexpr double kNegligibleSolids = 1e-2;   // less: slower patches
// Bounds of the slope of a stiffening law, relative to rest; tuned: mass slows steeper springs (docs/notebook.md, 35).
constexpr double kSlopeLeast = 4, kSlopeMost = 100;

constexpr int kLane = 8;  // samples side by side: floats of a 256-bit register
static_assert(kSamples % kLane == 0);
using Lane = EightFloats;

/// Numbers of an element at the samples.
template <int kRows>
using AtSamples = Eigen::Matrix<float, kRows, kSamples, Eigen::RowMajor>;

/// Computes l and 1 / l from the square of l.
[[gnu::always_inline]] inline void length_of(const Lane& square, Lane& length, Lane& inverse) {
  for (int i = 0; i < kLane; ++i) length[i] = std::max(std::sqrt(square[i]), static_cast<float>(kElementLengthMinM));
  inverse = 1.0F / length;
}

/// Springs of a body. `Kind` of ElementCandidates.
class SpringCandidates {
 public:
  static constexpr int kDimension = 1, kChosenMax = kMaxSprings;
  // Measured: 2,000 cost the organ 1.5 dB, 400 `softcore6` 2 to 4 dB (docs/notebook.md, 30, 41); more take longer.
  static constexpr std::size_t kEvaluatedMax = 5000, kCandidatesMax = 600;

  SpringCandidates(const WholeBody& body, const Matrix& moved, const Matrix& u, int tool)
      : at_(&body), moved_(moved.cast<float>()), tool_(tool) {
    elements_ = nonlinear_elements(body.dynamics(), body.state(), moved * root_of(u), kNegligibleSprings, kEvaluatedMax);
    const LumpedBody& of = body.dynamics().body();
    stiffening_ = of.law == SpringLaw::stiffening ? static_cast<float>(of.stiffening) : 0.0F;
  }
  std::size_t count() const { return elements_.size(); }
  bool is_valid() const {
    for (std::size_t k = 0; k < count(); ++k)
      if (!(span(k).norm() > kElementLengthMinM)) return false;
    return count() > 0;
  }
  std::size_t places() const { return at_->dynamics().body().nodes.size(); }
  std::uint32_t place(std::size_t k, int end) const { return end == 0 ? spring(k).a : spring(k).b; }
  const Rows& moved() const { return moved_; }
  const Vector& at_stamp() const { return at_->state().x; }
  int tool() const { return tool_; }
  int tool_axes() const { return at_->dynamics().body().planar ? 2 : 3; }
  static Eigen::Matrix<float, 1, 1> gradients(std::size_t) { return Eigen::Matrix<float, 1, 1>::Ones(); }

  /// Replaces the relative displacement of the ends by the force beyond the linear one.
  void residual(std::size_t k, AtSamples<3>& at) const {
    const Element& e = spring(k);
    const Eigen::Vector3f d = span(k).cast<float>();
    const auto stiffness = static_cast<float>(e.stiffness_n_m), rest = static_cast<float>(e.rest_length_m);
    const float length = d.norm(), strain = (length - rest) / rest, square = stiffening_ * strain * strain;
    const Eigen::Vector3f n = d / length;
    const float tension = stiffness * rest * strain * (1 + square), across = tension / length;
    const float along = stiffness * (1 + 3 * square) - across;
    for (Eigen::Index s = 0; s < kSamples; s += kLane) {
      Lane delta[3], now[3], squared{}, stretched, inverse, stretch{};
      for (int i = 0; i < 3; ++i) {
        load_lanes(at.row(i).data() + s, delta[i]);
        now[i] = delta[i] + d[i];
        add_product(now[i], now[i], squared);
        add_product(n[i], delta[i], stretch);
      }
      length_of(squared, stretched, inverse);
      Lane pull = stiffness - (stiffness * rest) * inverse;  // force over length
      if (stiffening_ > 0) {
        const Lane strained = (stretched - rest) * (1 / rest);
        pull *= 1 + stiffening_ * strained * strained;
      }
      const Lane turned = -tension - along * stretch, more = pull - across;
      for (int i = 0; i < 3; ++i) {
        Lane force = more * delta[i];
        add_product(d[i], pull, force);
        add_product(n[i], turned, force);
        store_lanes(force, at.row(i).data() + s);
      }
    }
  }
  void prepare(SampledElements& all) const { all.stiffening = stiffening_; }
  void describe(std::size_t k, SampledElements& all) const {
    const Element& e = spring(k);
    append(e.stiffness_n_m, all.stiffness);
    append(e.damping_n_s_m, all.damping);
    append(e.rest_length_m, all.rest_length);
  }
  static void append(double number, Eigen::VectorXf& to) {
    to.conservativeResize(to.size() + 1);
    to.tail<1>()[0] = static_cast<float>(number);
  }

 private:
  const Element& spring(std::size_t k) const { return at_->dynamics().body().elements[elements_[k]]; }
  Vec3 span(std::size_t k) const { return at_node(at_->state().x, spring(k).b) - at_node(at_->state().x, spring(k).a); }

  const WholeBody* at_;
  Rows moved_;
  int tool_;
  float stiffening_ = 0;
  std::vector<std::uint32_t> elements_;
};

/// Finite elements of a body. `Kind` of ElementCandidates.
class SolidCandidates {
 public:
  static constexpr int kDimension = 3, kChosenMax = kMaxFiniteElements;
  // Fewer than for springs, as each costs more. More are more accurate and take longer.
  static constexpr std::size_t kEvaluatedMax = 2000, kCandidatesMax = 200;

  SolidCandidates(const WholeBody& body, const Matrix& moved, const Matrix& u, int tool)
      : materials_(&body.dynamics().body().materials),
        points_(body.dynamics(), body.state(), moved,
                nonlinear_elements(body.dynamics(), body.state(), moved * root_of(u), kNegligibleSolids, kEvaluatedMax), tool) {
    constexpr std::size_t kTogether = ElementLinearisation::kElements;
    for (std::size_t k = 0; k < count(); ++k) {
      // A law and its place among those that are linearised together.
      auto& open = points_.is_triangle(element(k)) ? open_triangles_ : open_solids_;
      if (open.filled % kTogether == 0) {
        open.stamp = stamps_.size();
        stamps_.emplace_back(material_of(k).parameters());
      }
      const LameParameters lame = lame_of(k);
      at_.push_back({open.stamp, open.filled++ % kTogether});
      stamps_[at_.back().stamp].set(at_.back().lane, mean_gradient(body.dynamics(), element(k), body.state().x), lame.mu,
                                    lame.lambda);
    }
    for (ElementLinearisation& stamp : stamps_) stamp.linearise();
  }
  std::size_t count() const { return points_.elements().size(); }
  bool is_valid() const { return count() > 0; }
  std::size_t places() const { return points_.count(); }
  std::uint32_t place(std::size_t k, int i) const { return points_.place(element(k), i); }
  const Rows& moved() const { return points_.moved(); }
  const Vector& at_stamp() const { return points_.at_stamp(); }
  int tool() const { return points_.tool(); }
  static int tool_axes() { return 3; }
  Eigen::Matrix3f gradients(std::size_t k) const { return points_.rest(element(k)).b.rightCols<3>().transpose().cast<float>(); }

  /// Replaces dF by V Q.
  void residual(std::size_t k, AtSamples<9>& at) const {
    AtSamples<9> q;
    stamps_[at_[k].stamp].stresses(at_[k].lane, kSamples, at.data(), q.data());
    at = q;
  }
  void prepare(SampledElements& all) const { all.law = materials_->front().parameters(); }
  void describe(std::size_t k, SampledElements& all) const {
    const LameParameters lame = lame_of(k);
    SpringCandidates::append(lame.mu, all.stiffness);
    SpringCandidates::append(lame.lambda, all.dilation);
    SpringCandidates::append(material_of(k).damping_s, all.damping);
  }
  const Vector& at_rest() const { return points_.at_rest(); }

 private:
  struct Open {
    std::size_t stamp = 0, filled = 0;
  };
  struct Place {
    std::size_t stamp, lane;
  };
  std::uint32_t element(std::size_t k) const { return points_.elements()[k]; }
  const SolidMaterial& material_of(std::size_t k) const { return (*materials_)[points_.material(element(k))]; }
  /// Returns the Lame parameters times the volume [J].
  LameParameters lame_of(std::size_t k) const {
    const SolidMaterial& m = material_of(k);
    return lame_parameters(m.law, points_.rest(element(k)).volume_m3 * m.young_pa, m.poisson);
  }

  const std::vector<SolidMaterial>* materials_;
  GradientPoints points_;
  Open open_solids_, open_triangles_;
  std::vector<ElementLinearisation> stamps_;
  std::vector<Place> at_;
};

/// Elements of a body at the samples. `Kind` has their places, motion and law.
template <typename Kind>
class ElementCandidates {
 public:
  static constexpr int kDimension = Kind::kDimension, kNodes = kDimension + 1, kRows = 3 * kDimension;

  ElementCandidates(const Kind& kind, const Matrix& u) : kind_(kind), samples_(u.cast<float>()) { assert(u.cols() == kSamples); }

  /// Returns the nonlinear forces of all elements on the variables, n x samples; `parts`: |Q| |H| of each.
  Eigen::MatrixXf all_together(Eigen::VectorXf& parts) const {
    thread_local SampleMatrix there, forces;  // reused: megabytes that would be allocated for every patch
    const Rows& moved = kind_.moved();
    there.noalias() = moved * samples_;
    forces.setZero(there.rows(), kSamples);
    parts.resize(static_cast<Eigen::Index>(kind_.count()));
    AtSamples<kRows> at;
    AtSamples<3> pull;
    for (std::size_t k = 0; k < kind_.count(); ++k) {
      const Eigen::Matrix<float, kDimension, kDimension> b = kind_.gradients(k);
      at.setZero();
      float size = 0;
      for (int i = 0; i < kDimension; ++i) {
        const float* const to = there.row(row(k, i + 1)).data();
        const float* const from = there.row(row(k, 0)).data();
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < kDimension; ++c)
            for (int s = 0; s < kSamples; ++s)
              at(kDimension * r + c, s) += b(i, c) * (to[kSamples * r + s] - from[kSamples * r + s]);
        size += b.row(i).squaredNorm() * (moved.middleRows<3>(row(k, i + 1)) - moved.middleRows<3>(row(k, 0))).squaredNorm();
      }
      kind_.residual(k, at);
      for (int i = 0; i < kDimension; ++i) {
        for (int r = 0; r < 3; ++r) {
          pull.row(r) = b(i, 0) * at.row(kDimension * r);
          for (int c = 1; c < kDimension; ++c) pull.row(r) += b(i, c) * at.row(kDimension * r + c);
        }
        forces.middleRows<3>(row(k, i + 1)) += pull;
        forces.middleRows<3>(row(k, 0)) -= pull;
      }
      parts[static_cast<Eigen::Index>(k)] = at.norm() * std::sqrt(size);
    }
    return moved.transpose() * forces;
  }
  /// Returns H of some elements, kRows rows each.
  Eigen::MatrixXf motions(const std::vector<std::uint32_t>& elements) const {
    const Rows& moved = kind_.moved();
    Eigen::MatrixXf h(kRows * static_cast<Eigen::Index>(elements.size()), moved.cols());
    std::vector<Eigen::Matrix3Xf> edges(kDimension);
    for (std::size_t k = 0; k < elements.size(); ++k) {
      for (int i = 0; i < kDimension; ++i)
        edges[static_cast<std::size_t>(i)] =
            moved.middleRows<3>(row(elements[k], i + 1)) - moved.middleRows<3>(row(elements[k], 0));
      h.middleRows<kRows>(kRows * static_cast<Eigen::Index>(k)) = gradient_motion(kind_.gradients(elements[k]), edges);
    }
    return h;
  }
  /// Returns the forces of elements with given H.
  ElementForces forces_of(const std::vector<std::uint32_t>& elements, const Eigen::MatrixXf& motions) const {
    const auto count = static_cast<Eigen::Index>(elements.size());
    ElementForces b{std::vector<Rows>(kRows), std::vector<SampleMatrix>(kRows)};
    for (Eigen::Index i = 0; i < kRows; ++i) {
      Rows& motion = b.motion[static_cast<std::size_t>(i)];
      motion = motions(Eigen::seqN(i, count, kRows), Eigen::all);
      b.force[static_cast<std::size_t>(i)].noalias() = motion * samples_;
    }
    AtSamples<kRows> at;
    for (Eigen::Index k = 0; k < count; ++k) {
      for (Eigen::Index i = 0; i < kRows; ++i) at.row(i) = b.force[static_cast<std::size_t>(i)].row(k);
      kind_.residual(elements[static_cast<std::size_t>(k)], at);
      for (Eigen::Index i = 0; i < kRows; ++i) b.force[static_cast<std::size_t>(i)].row(k) = at.row(i);
    }
    return b;
  }
  /// Returns the elements themselves, without weights, with their nodes' motions as sent.
  SampledElements taken(const std::vector<std::uint32_t>& elements) const {
    NodeNumbering met;
    SampledElements all;
    all.nodes.resize(kNodes, static_cast<Eigen::Index>(elements.size()));
    kind_.prepare(all);
    for (std::size_t k = 0; k < elements.size(); ++k) {
      for (int i = 0; i < kNodes; ++i) all.nodes(i, static_cast<Eigen::Index>(k)) = met.number_of(kind_.place(elements[k], i));
      kind_.describe(elements[k], all);
    }
    all.position = met.places(kind_.at_stamp());
    if constexpr (kDimension == 3) all.rest = met.places(kind_.at_rest());
    all.motion = met.motion(kind_.moved(), kind_.tool(), kind_.tool_axes());
    return all;
  }

  /// Chooses and weights elements (sampling.hpp).
  std::optional<SampledElements> fit(const Matrix& u, const Sampling& sampling) const {
    Eigen::VectorXf parts;
    const SampledResiduals fit(all_together(parts), u, sampling);
    const std::vector<std::uint32_t> candidates = largest(parts, Kind::kCandidatesMax);
    std::vector<std::uint32_t> nodes;
    for (const std::uint32_t k : candidates)
      for (int i = 0; i < kNodes; ++i) nodes.push_back(kind_.place(k, i));
    ByteCosts costs(std::move(nodes), kNodes, kind_.places(),
                    [&](int met, int count) { return numbers_of(sampling.budget, met, count); });
    const SparseSolution few =
        sparse_nnls(fit.parts(forces_of(candidates, motions(candidates))), fit.all(), Kind::kChosenMax, kFitError, costs);
    if (few.columns.empty()) return std::nullopt;
    std::vector<std::uint32_t> chosen;
    for (const Eigen::Index column : few.columns) chosen.push_back(candidates[static_cast<std::size_t>(column)]);
    SampledElements all = taken(chosen);
    const SparseSolution w = positive_weights(fit.parts(forces_of(chosen, all.motions(sampling.tool < 0 ? 0 : 3))), fit.all());
    if (w.columns.empty()) return std::nullopt;
    return weighed(std::move(all), w);
  }

 private:
  Eigen::Index row(std::size_t k, int i) const { return 3 * static_cast<Eigen::Index>(kind_.place(k, i)); }
  /// Returns the elements that have weights, with these.
  static SampledElements weighed(SampledElements all, const SparseSolution& w) {
    const auto keep = [&](Eigen::VectorXf& numbers, bool weighted) {
      if (numbers.size() == 0) return;
      numbers = Eigen::VectorXf(numbers(w.columns));
      if (weighted) numbers = numbers.cwiseProduct(w.weights).eval();
    };
    all.nodes = Eigen::MatrixXi(all.nodes(Eigen::all, w.columns));
    keep(all.stiffness, true);
    keep(all.damping, kDimension == 1);  // of finite elements a time
    keep(all.dilation, true);
    keep(all.rest_length, false);
    return all;
  }

  const Kind& kind_;
  Eigen::MatrixXf samples_;
};

/// Returns the steepest slope that each spring reaches, relative to rest, in responses of the body as large as they are likely to
/// become, in both directions. Samples go further, but the assumed stiffness costs mass (sampled_springs.hpp).
Eigen::ArrayXd steepest_slopes(const SampledElements& springs, const Matrix& likely, int tool) {
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

template <typename Kind>
std::optional<SampledElements> sample(const WholeBody& body, const Matrix& moved, const Sampling& sampling) {
  const Matrix u = samples(sampling);
  assert(moved.rows() == body.state().x.size() && moved.cols() == u.rows());
  const Kind kind(body, moved, u, sampling.tool);
  if (!kind.is_valid()) return std::nullopt;
  return ElementCandidates<Kind>(kind, u).fit(u, sampling);
}

}  // namespace

std::optional<SampledElements> sample_elements(const WholeBody& body, const Matrix& moved, const Sampling& sampling) {
  if (body.dynamics().body().is_solid()) return sample<SolidCandidates>(body, moved, sampling);
  auto found = sample<SpringCandidates>(body, moved, sampling);
  if (found && found->stiffening > 0)
    found->max_slope = SampledElements::steep_of(steepest_slopes(*found, sampling.likely, sampling.tool < 0 ? 0 : 3));
  return found;
}

}  // namespace palpate
