#include "server/body/stillness.hpp"

#include <algorithm>
#include <limits>

namespace palpate {

Stillness::Stillness(const Dynamics& dynamics, double softest_1_s2) : dynamics_(&dynamics), w2_(kSofter * softest_1_s2) {
  double lightest_kg = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (!dynamics.body().fixed[i]) lightest_kg = std::min(lightest_kg, dynamics.body().masses_kg[i]);
  most_kg_m2_ = lightest_kg * 0.25 * kMovesM * kMovesM;
}

bool Stillness::holds(const BodyState& state) {
  if (!(w2_ > 0)) return false;
  // The speed alone tells while a body swings, for a fraction of what its forces cost.
  const double speed2 = state.v.dot(dynamics_->masses().cwiseProduct(state.v));
  if (!(speed2 <= most_kg_m2_ * w2_)) return false;
  dynamics_->forces(state.x, Vector::Zero(state.x.size()), f_);
  mask(dynamics_->body().fixed, f_);
  return speed2 + f_.dot(f_.cwiseQuotient(dynamics_->masses())) / w2_ <= most_kg_m2_ * w2_;
}

}  // namespace palpate
