#include "server/room/snapshot_cache.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace palpate {

bool SnapshotCache::near(const State& state, std::span<const Vec3> tools) const {
  return std::any_of(tools.begin(), tools.end(), [&](const Vec3& a) {
    return std::any_of(state.tools.begin(), state.tools.end(), [&](const Vec3& b) { return alike(a, b); });
  });
}

/// Compares in chunks: most states differ early on.
bool SnapshotCache::apart(const Vector& a, const Vector& b) const {
  assert(a.size() == b.size());
  constexpr Eigen::Index kComparedAtOnce = 512;  // 4 kB of each, well within the first-level cache
  for (Eigen::Index i = 0; i < a.size(); i += kComparedAtOnce) {
    const Eigen::Index n = std::min(kComparedAtOnce, a.size() - i);
    if ((a.segment(i, n) - b.segment(i, n)).cwiseAbs().maxCoeff() > kDifferenceEdges * edge_m_) return true;
  }
  return false;
}

void SnapshotCache::keep(std::span<const Vec3> tools, const Vector& x) {
  assert(!tools.empty());
  if (std::any_of(states_.begin(), states_.end(), [&](const State& s) { return !apart(s.x, x); })) return;
  if (states_.empty()) origin_ = x;
  const bool full = states_.size() == kStatesMax;
  const auto place = !full ? states_.emplace(states_.end())
                           : std::min_element(states_.begin(), states_.end(),
                                              [](const State& a, const State& b) { return a.of_use < b.of_use; });
  *place = {{tools.begin(), tools.end()}, x, now_};
  const Eigen::Index k = place - states_.begin();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const auto other = static_cast<Eigen::Index>(i);
    products_(k, other) = products_(other, k) = (states_[i].x - origin_).dot(x - origin_);
  }
}

std::vector<const Vector*> SnapshotCache::most_informative(std::span<const Vec3> tools, const Vector& x) {
  assert(states_.empty() || x.size() == origin_.size());
  constexpr double kInformativeShare = 0.01;  // of the farthest's distance: less is nearly in the span of the others
  ++now_;
  std::vector<Eigen::Index> known;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (!near(states_[i], tools)) continue;
    states_[i].of_use = now_;
    if (apart(states_[i].x, x)) known.push_back(static_cast<Eigen::Index>(i));
  }
  const auto count = static_cast<Eigen::Index>(known.size());
  std::vector<const Vector*> chosen;
  if (count == 0) return chosen;
  const auto state = [&](Eigen::Index i) -> const Vector& {
    return states_[static_cast<std::size_t>(known[static_cast<std::size_t>(i)])].x;
  };
  const Vector here = x - origin_;
  Vector with_here(count);
  for (Eigen::Index i = 0; i < count; ++i) with_here[i] = (state(i) - origin_).dot(here);
  Matrix products = products_(known, known);  // of the displacements from x
  products.array() += here.squaredNorm();
  products.colwise() -= with_here;
  products.rowwise() -= with_here.transpose();
  Matrix along(count, static_cast<Eigen::Index>(kChosenMax));  // Q^T (x_i - x)
  Vector left = products.diagonal();
  const double enough = kInformativeShare * kInformativeShare * left.maxCoeff();
  while (chosen.size() < kChosenMax) {
    Eigen::Index next = 0;
    if (!(left.maxCoeff(&next) > enough)) break;
    const auto k = static_cast<Eigen::Index>(chosen.size());
    along.col(k) = (products.col(next) - along.leftCols(k) * along.row(next).head(k).transpose()) / std::sqrt(left[next]);
    left -= along.col(k).cwiseAbs2();
    left[next] = 0;
    chosen.push_back(&state(next));
  }
  return chosen;
}

}  // namespace palpate
