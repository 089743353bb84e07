#include "server/body/stillness.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace palpate {

Stillness::Stillness(const Dynamics& dynamics, double softest_1_s2, Vector rest)
    : dynamics_(&dynamics), rest_(std::move(rest)), w2_(kSofter * dynamics.relaxation().left() * softest_1_s2) {
  double lightest_kg = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (!dynamics.body().fixed[i]) lightest_kg = std::min(lightest_kg, dynamics.body().masses_kg[i]);
  most_kg_m2_ = lightest_kg * 0.25 * kMovesM * kMovesM;
}

/// Returns q^T K q, or a bound of it.
double Stillness::unbalanced(const BodyState& state) {
  const BodyState still{state.time_s,  state.x,      Vector::Zero(state.x.size()), state.history, nullptr,
                        state.anchors, state.sutures};
  dynamics_->forces(still, f_);
  const double now = unbalanced_by(state.x);
  const Relaxation& relaxation = dynamics_->relaxation();
  if (relaxation.empty()) return now;
  const std::vector<Vector> pulls = relaxation.pulls(still);
  for (std::size_t k = 0; k < pulls.size(); ++k) f_ += relaxation.branches()[k].share * pulls[k];
  return std::max(now, unbalanced_by(state.x));
}

/// Returns the same for the forces in f_.
double Stillness::unbalanced_by(const Vector& x) {
  mask(dynamics_->body().fixed, f_);
  const double bound = f_.dot(f_.cwiseQuotient(dynamics_->masses())) / w2_;
  if (rest_.size() == 0 || (x - rest_).lpNorm<Eigen::Infinity>() > kBackM) return bound;
  return std::clamp(-f_.dot(x - rest_), 0.0, bound);
}

bool Stillness::holds(const BodyState& state) {
  if (!(w2_ > 0)) return false;
  // While a body oscillates its speed is enough, at a fraction of the cost of its forces.
  const double speed2 = state.v.dot(dynamics_->masses().cwiseProduct(state.v));
  return speed2 <= most_kg_m2_ * w2_ && speed2 + unbalanced(state) <= most_kg_m2_ * w2_;
}

}  // namespace palpate
