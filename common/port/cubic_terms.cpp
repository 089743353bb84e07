#include "common/port/cubic_terms.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace palpate {
namespace {

using Pairs = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, pairs_of(kMaxVariables)>;
using Triples = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, triples_of(kMaxLeading)>;

// In colexicographic order the monomials of a degree that end with y_k are those of the degree below up to y_k, times y_k.

template <typename Values, typename Out>
void fill_pairs(const Values& y, int n, Out& pairs) {
  pairs.resize(pairs_of(n));
  for (int k = 0; k < n; ++k) pairs.segment(pairs_of(k), k + 1) = y[k] * y.head(k + 1);
}

template <typename Values, typename In, typename Out>
void fill_triples(const Values& y, const In& pairs, int n, Out& triples) {
  triples.resize(triples_of(n));
  for (int k = 0; k < n; ++k) triples.segment(triples_of(k), pairs_of(k + 1)) = y[k] * pairs.head(pairs_of(k + 1));
}

/// How often p stands among the sorted indices, with p itself put in: the factor of the derivative.
template <std::size_t size>
float multiplicity(const std::array<int, size>& indices, int p) {
  return static_cast<float>(std::count(indices.begin(), indices.end(), p));
}

/// alpha of dampers that push g, without which the rates at the end are `at_end`; none where they do not brake. `closing`: of the
/// modes, the last.
std::optional<double> share_at_end(const CubicForce::Variables& g, const CubicForce::Variables& rate,
                                   const CubicForce::Variables& at_end, const ModeMatrix& closing) {
  const auto r = closing.rows();
  const double power = rate.dot(g), taken = g.tail(r).dot(closing * g.tail(r));
  if (!(power > 0) || !(taken >= 0)) return {};
  return at_end.dot(g) / (power + taken);
}

}  // namespace

bool has_room(const PortSurface& surface, const CubicTerms& terms) {
  return surface.vertex_count + static_cast<int>(terms.vertices.size()) <= kMaxPortVertices &&
         surface.triangle_count + static_cast<int>(terms.triangles.size()) <= kMaxPortTriangles;
}

Patch extended(Patch patch, const CubicTerms& terms) {
  PortSurface& surface = patch.surface;
  std::copy(terms.vertices.begin(), terms.vertices.end(), surface.vertices.begin() + surface.vertex_count);
  std::copy(terms.triangles.begin(), terms.triangles.end(), surface.triangles.begin() + surface.triangle_count);
  surface.vertex_count += static_cast<int>(terms.vertices.size());
  surface.triangle_count += static_cast<int>(terms.triangles.size());
  return patch;
}

Eigen::MatrixXd joint_stiffness(const Patch& patch, const Eigen::VectorXd& stiffness) {
  const Eigen::Index first = patch.contact == ContactKind::attach ? 3 : 0, r = stiffness.size();
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(first + r, first + r);
  h.bottomRightCorner(r, r).diagonal() = stiffness;
  if (first > 0) h.topLeftCorner<3, 3>() = patch.k_port;
  if (first > 0 && r > 0) {
    h.bottomLeftCorner(r, 3) = -patch.b_k;
    h.topRightCorner(3, r) = -patch.b_k.transpose();
  }
  return h;
}

Eigen::MatrixXd joint_damping(const Patch& patch) {
  const Eigen::Index first = patch.contact == ContactKind::attach ? 3 : 0, r = patch.modes();
  Eigen::MatrixXd d(first + r, first + r);
  d.bottomRightCorner(r, r) = patch.damping;
  if (first > 0) {
    d.topLeftCorner<3, 3>() = patch.d_port;
    d.bottomLeftCorner(r, 3) = -patch.b_d;
    d.topRightCorner(3, r) = -patch.b_d.transpose();
  }
  return d;
}

CubicForce::CubicForce(const CubicTerms& terms)
    : variables_(terms.variables),
      leading_(terms.leading),
      has_e2_(terms.e2.size() > 0),
      radius_(static_cast<float>(terms.radius)),
      scale_(terms.scale),
      q_(terms.q) {
  const int n = variables_;
  if (has_e2_) {
    g2_.resize(n, n);
    for (int p = 0; p < n; ++p)
      for (int i = 0; i < n; ++i) g2_(p, i) = (p == i ? 2.0F : 1.0F) * terms.e2[pair_at(std::min(p, i), std::max(p, i))];
  }
  if (!terms.sampled()) take_polynomials(terms);
}

void CubicForce::take_polynomials(const CubicTerms& terms) {
  const int n = variables_, l = leading_;
  g3_.resize(n, pairs_of(n));
  for (int p = 0; p < n; ++p)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i <= j; ++i) {
        std::array<int, 3> m{i, j, p};
        std::sort(m.begin(), m.end());
        g3_(p, pair_at(i, j)) = multiplicity(m, p) * terms.e3[triple_at(m[0], m[1], m[2])];
      }
  g4_.resize(l, triples_of(l));
  for (int p = 0; p < l; ++p)
    for (int k = 0; k < l; ++k)
      for (int j = 0; j <= k; ++j)
        for (int i = 0; i <= j; ++i) {
          std::array<int, 4> m{i, j, k, p};
          std::sort(m.begin(), m.end());
          g4_(p, triple_at(i, j, k)) = multiplicity(m, p) * terms.e4[quadruple_at(m[0], m[1], m[2], m[3])];
        }
}

CubicForce::CubicForce(const CubicTerms& terms, const Patch& patch) : CubicForce(terms) {
  constexpr double kRounding = 1e-6;   // numbers travel in single precision
  constexpr double kTouchBraked = 20;  // norm of D in steps, below which a touch gains nothing by S
  const int n = variables_, l = leading_;
  if (n == 0) return;
  steps_ = terms.grasp ? kGraspSteps : kTouchSteps;
  if (terms.sampled()) {
    for (const bool slowed : {false, true}) {
      if (slowed && terms.springs.count() > 0) steps_ *= 2;
      take_sampled(terms, slowed);
      if (has_sampled()) break;
    }
    radius_ = std::numeric_limits<float>::max();
    if (!has_sampled()) {
      steps_ = 1;
      variables_ = 0;
      return;
    }
  }
  const Eigen::MatrixXd t = terms.scale.inverse();
  linear_ = (t.transpose() * joint_stiffness(patch, patch.stiffness) * t).cast<float>();
  if (has_e2_ && has_sampled()) {
    Eigen::MatrixXd far = (linear_ + g2_).cast<double>() + of_sampled([](const auto& s) { return s.far_stiffness(); });
    far.diagonal().array() += kRounding * far.trace() / n;  // nothing holds a tool that moves across a planar body
    has_e2_ = Eigen::LLT<Eigen::MatrixXd>(far).info() == Eigen::Success;
  }
  if (terms.q.size() == 0 && !has_sampled()) return;
  if (!has_sampled()) turned_at_stamp_ = q_.transpose() * terms.rate.head(l).cast<float>();
  Eigen::MatrixXd d = t.transpose() * joint_damping(patch) * t;
  d.diagonal().array() += kRounding * d.trace() / n;
  const Eigen::LLT<Eigen::MatrixXd> factor(d);
  has_damping_ = factor.info() == Eigen::Success && d.trace() > 0;
  root_ = Eigen::MatrixXd(factor.matrixU()).cast<float>();
  inverse_ = factor.matrixL().solve(Eigen::MatrixXd::Identity(n, n)).cast<float>();
  const auto* const solid = std::get_if<SampledSolidForce>(&sampled_);
  const bool brakes = terms.grasp || patch.damping.norm() > kTouchBraked * kHapticRateHz * steps_;
  if (solid != nullptr && brakes) turned_ = TurnedDampers(*solid, patch.damping);
}

const ModeMatrix& CubicForce::added_mass() const {
  return of_sampled([](const auto& s) -> const ModeMatrix& { return s.added_mass(); });
}

void CubicForce::take_sampled(const CubicTerms& terms, bool slowed) {
  const int tool = terms.grasp ? 3 : 0;
  const double step_s = 1.0 / (kHapticRateHz * steps_);
  if (terms.springs.count() > 0)
    sampled_.emplace<SampledForce>(terms.springs, tool, terms.rate, step_s, slowed);
  else
    sampled_.emplace<SampledSolidForce>(terms.solid, tool, step_s, slowed);
}

float CubicForce::polynomial(Values& g) const noexcept {
  Pairs pairs;
  fill_pairs(y_, variables_, pairs);
  g.noalias() = g3_ * pairs;
  // Each energy is homogeneous: E_m = y . grad E_m / m.
  float energy = y_.dot(g) / 3;
  Triples triples;
  fill_triples(y_, pairs, leading_, triples);
  const Values fourth = g4_ * triples;
  energy += y_.head(leading_).dot(fourth) / 4;
  g.head(leading_) += fourth;
  return energy;
}

float CubicForce::linear_energy(const Values& y) const noexcept { return 0.5F * y.dot(linear_ * y); }

void CubicForce::turn_dampers(const Values& rate, Values& change, Values& at_stamp) const noexcept {
  if (has_sampled()) return of_sampled([&](const auto& s) { s.damping(rate, change, at_stamp); });
  const int l = leading_;
  const Values& y = y_;
  using Mixed = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, kLeadingPairs>;
  const auto turn = [&](const Mixed& turned, Values& to) {
    for (int k = 0; k < l; ++k) {
      for (int j = 0; j < k; ++j) {
        to[j] += turned[pair_at(j, k)] * y[k];
        to[k] += turned[pair_at(j, k)] * y[j];
      }
      to[k] += turned[pair_at(k, k)] * y[k];
    }
  };
  Mixed mixed(pairs_of(l));
  for (int k = 0; k < l; ++k) {
    for (int j = 0; j < k; ++j) mixed[pair_at(j, k)] = y[j] * rate[k] + y[k] * rate[j];
    mixed[pair_at(k, k)] = y[k] * rate[k];
  }
  change.setZero(variables_);
  at_stamp.setZero(variables_);
  change.head(l).noalias() = q_ * mixed;
  turn(q_.transpose() * rate.head(l), change);
  turn(turned_at_stamp_, at_stamp);
}

CubicForce::Values CubicForce::within(const Values& asked) const noexcept {
  const float norm = asked.norm();
  return norm > radius_ ? Values(asked * (radius_ / norm)) : asked;
}

void CubicForce::move_to(const Variables& u) noexcept {
  asked_ = (scale_ * u).cast<float>();
  y_ = within(asked_);
  if (has_sampled()) std::visit([&](auto& s) { s.move_to(y_); }, sampled_);
}

void CubicForce::elastic(Variables& force) const noexcept {
  const float norm = asked_.norm();
  const bool outside = norm > radius_;
  // Along a ray the energy does not change outside.
  const auto continued = [&](const Values& g) {
    return outside ? Values((radius_ / norm) * (g - y_.dot(g) / (radius_ * radius_) * y_)) : g;
  };
  Values g(variables_);
  if (has_sampled()) {
    of_sampled([&](const auto& s) { s.gradient(g); });
  } else {
    const float energy = polynomial(g);
    g = continued(g);
    if (linear_.size() > 0 && energy < -kSoftening * linear_energy(asked_)) g = -kSoftening * (linear_ * asked_);
  }
  if (has_e2_) g += continued(g2_ * y_);
  force.noalias() = -(scale_.transpose() * g.cast<double>());
}

void CubicForce::damping(const Variables& u_rate, const ModeMatrix& closing, const Variables& before, Variables& force) noexcept {
  force.setZero(u_rate.size());
  if (!has_damping_) return;
  const Values rate = (scale_ * u_rate).cast<float>();
  Values change(variables_), at_stamp(variables_);
  turn_dampers(rate, change, at_stamp);
  const float most = (has_sampled() ? kSpringDamperChange : kDamperChange) * (root_ * rate).norm();
  if (!turned_.empty()) {
    brake_at_end(change.cast<double>(), u_rate, closing, before, most, force);
    since_asked_ = (since_asked_ + 1) % steps_;
    if (since_asked_ == 0) turned_.renew(std::get<SampledSolidForce>(sampled_), closing);
    return;
  }
  force.noalias() = -(scale_.transpose() * (change - at_stamp).cast<double>());
  const float size = (inverse_ * change).norm();
  if (!(size > most)) return;
  std::optional<double> share;
  if (has_sampled()) {
    Variables at_end = u_rate;
    at_end.tail(closing.rows()) += closing * (at_stamp.cast<double>() - before).tail(closing.rows());
    share = share_at_end(change.cast<double>(), u_rate, at_end, closing);
  }
  force *= share.value_or(static_cast<double>(most / size));
}

void CubicForce::brake_at_end(const Variables& change, const Variables& u_rate, const ModeMatrix& closing,
                              const Variables& before, float most, Variables& force) const noexcept {
  const auto r = closing.rows();
  const TurnedDampers::ForVariables& s = turned_.change();
  const ModeMatrix& closing_held = turned_.closing().size() > 0 ? turned_.closing() : closing;
  const Variables held = s * u_rate, g = change - held;
  const ModeVector carried = closing * before.tail(r);
  ModeVector push = s.bottomRightCorner(r, r) * carried - held.tail(r);
  const float size = (inverse_ * g.cast<float>()).norm();
  double part = 1;
  if (size > most) {
    Variables at_end = u_rate;
    at_end.tail(r) += closing_held * push - carried;
    part = share_at_end(g, u_rate, at_end, closing_held).value_or(static_cast<double>(most / size));
  }
  push -= part * g.tail(r);
  const ModeVector slowed = closing_held * push - carried;  // what the modes' rates change by
  force.noalias() = -held - part * g - s.rightCols(r) * slowed;
}

double CubicForce::energy() const noexcept {
  Values g(variables_);
  double energy = 0;
  if (has_sampled())
    energy = of_sampled([&](const auto& s) { return s.energy(); });
  else if (energy = static_cast<double>(polynomial(g)); linear_.size() > 0)
    energy = std::max(energy, static_cast<double>(-kSoftening * linear_energy(asked_)));
  if (has_e2_) energy += static_cast<double>(y_.dot(g2_ * y_) / 2);
  return energy;
}

}  // namespace palpate
