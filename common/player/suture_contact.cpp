#include "common/player/suture_contact.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace palpate {

SutureContact::SutureContact(const Patch& patch, const StateInput& psi0) : suture_(patch.suture) {
  if (empty()) return;
  const auto r = patch.modes();
  const auto n = static_cast<std::size_t>(suture_.law.bites);
  for (std::size_t j = 0; j < n; ++j) {
    response_[j].setZero(2 * r, 3);
    if (r > 0) response_[j] = psi0 * suture_.bites[j].rows.transpose();
  }
  const SutureShape shape = shape_at(ModeVector::Zero(r), patch.tool);
  point(shape);
  double trace = 0;
  for (std::size_t i = 1; i <= n; ++i) trace += phi_[i].dot(moved_[i].head(r));
  share_next_ = 0.5 / std::max(suture_.law.stiffness_n_m * trace, 1.0);
  tension_n_ = pull_of(suture_.law, suture_.length_m, shape).tension_n;
  pull_.setZero(2 * r);
  for (std::size_t i = 1; i <= n; ++i) pull_ += tension_n_[i] * moved_[i];
  force_ = -tension_n_[n] * shape.along[n];
}

SuturePlace SutureContact::place_at(const ModeVector& q, const Vec3& hand) const noexcept {
  SuturePlace place;
  place.points.fill(Vec3::Zero());
  place.held = true;
  const auto n = static_cast<std::size_t>(suture_.law.bites);
  for (std::size_t j = 0; j < n; ++j) {
    place.points[j] = suture_.bites[j].position;
    place.points[j].noalias() += suture_.bites[j].rows * q;
  }
  place.points[n] = hand;
  return place;
}

SutureShape SutureContact::shape_at(const ModeVector& q, const Vec3& hand) const noexcept {
  return shape_of(suture_.law, place_at(q, hand));
}

void SutureContact::point(const SutureShape& shape) noexcept {
  const auto n = static_cast<std::size_t>(suture_.law.bites);
  for (std::size_t i = 1; i <= n; ++i) {
    phi_[i].noalias() = suture_.bites[i - 1].rows.transpose() * shape.along[i];
    moved_[i].noalias() = response_[i - 1] * shape.along[i];
    if (i == n) continue;
    phi_[i].noalias() -= suture_.bites[i].rows.transpose() * shape.along[i];
    moved_[i].noalias() -= response_[i] * shape.along[i];
  }
}

void SutureContact::carry_on(StateVector& next) const noexcept { next += share_next_ * pull_; }

void SutureContact::close(StateVector& z, const Vec3& hand) noexcept {
  constexpr double kToleranceN = 1e-7;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxBites, kMaxBites>;
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxBites, 1>;
  const auto r = z.size() / 2;
  const auto n = static_cast<std::size_t>(suture_.law.bites);
  const auto size = static_cast<Eigen::Index>(n);
  const auto row = [](std::size_t i) { return static_cast<Eigen::Index>(i) - 1; };
  const SutureShape free = shape_at(z.head(r), hand);
  point(free);
  Square yields(size, size);  // A
  for (std::size_t i = 1; i <= n; ++i)
    for (std::size_t m = 1; m <= n; ++m) yields(row(i), row(m)) = (1 - share_next_) * phi_[i].dot(moved_[m].head(r));
  Column tension(size);
  for (std::size_t i = 1; i <= n; ++i) tension[row(i)] = tension_n_[i];
  SutureShape shape = free;
  SuturePull pull;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Column shorter = yields * tension;
    for (std::size_t i = 1; i <= n; ++i) shape.distance_m[i] = std::max(0.0, free.distance_m[i] - shorter[row(i)]);
    pull = pull_of(suture_.law, suture_.length_m, shape);
    Column left(size);
    for (std::size_t i = 1; i <= n; ++i) left[row(i)] = pull.tension_n[i] - tension[row(i)];
    if (left.cwiseAbs().maxCoeff() < kToleranceN) break;
    Square slope(size, size);  // 1 + f' A
    for (std::size_t i = 1; i <= n; ++i)
      for (std::size_t m = 1; m <= n; ++m) slope(row(i), row(m)) = pull.tangent(i, m);
    slope = (slope * yields).eval();
    slope.diagonal().array() += 1;
    const Column step = slope.partialPivLu().solve(left);
    if (!step.allFinite()) break;
    tension = (tension + step).cwiseMax(0);
  }
  suture_.length_m = pull.length_m;
  pull_.setZero();
  for (std::size_t i = 1; i <= n; ++i) {
    tension_n_[i] = tension[row(i)];
    pull_ += tension_n_[i] * moved_[i];
  }
  force_ = -tension_n_[n] * free.along[n];
  z += (1 - share_next_) * pull_;
  if (!(suture_.law.tear_n > 0)) return;
  const SutureTear tear = tear_of(suture_.law, suture_.length_m, place_at(z.head(r), hand), kSettledInATick);
  if (tear.length_m == 0) return;
  suture_.length_m = tear.spans_m;
  for (std::size_t j = 0; j < n; ++j) suture_.bites[j].position += tear.way[j];
  const SutureShape torn = shape_at(z.head(r), hand);
  tension_n_ = pull_of(suture_.law, suture_.length_m, torn).tension_n;
  force_ = -tension_n_[n] * torn.along[n];
}

}  // namespace palpate
