#include "server/room/remembered_states.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

bool RememberedStates::near(const State& state, std::span<const Vec3> tools) const {
  return std::any_of(tools.begin(), tools.end(), [&](const Vec3& a) {
    return std::any_of(state.tools.begin(), state.tools.end(), [&](const Vec3& b) { return alike(a, b); });
  });
}

bool RememberedStates::apart(const Vector& a, const Vector& b) const { return (a - b).cwiseAbs().maxCoeff() > kApart * edge_m_; }

void RememberedStates::keep(std::span<const Vec3> tools, const Vector& x) {
  if (std::any_of(states_.begin(), states_.end(), [&](const State& s) { return !apart(s.x, x); })) return;
  if (states_.size() < kMost)
    states_.emplace_back();
  else
    std::iter_swap(states_.end() - 1, std::min_element(states_.begin(), states_.end(),
                                                       [](const State& a, const State& b) { return a.of_use < b.of_use; }));
  states_.back() = {{tools.begin(), tools.end()}, x, now_};
}

std::vector<const Vector*> RememberedStates::telling(std::span<const Vec3> tools, const Vector& x) {
  constexpr double kSaysMore = 0.01;  // of the farthest's distance
  ++now_;
  std::vector<const Vector*> known;
  for (State& state : states_) {
    if (!near(state, tools)) continue;
    state.of_use = now_;
    if (apart(state.x, x)) known.push_back(&state.x);
  }
  const auto count = static_cast<Eigen::Index>(known.size());
  std::vector<const Vector*> chosen;
  if (count == 0) return chosen;
  Matrix ways(x.size(), count), along(count, static_cast<Eigen::Index>(kTold));  // along: Q^T (x_i - x)
  for (Eigen::Index i = 0; i < count; ++i) ways.col(i) = *known[static_cast<std::size_t>(i)] - x;
  Vector left = ways.colwise().squaredNorm();
  const double enough = kSaysMore * kSaysMore * left.maxCoeff();
  while (chosen.size() < kTold) {
    Eigen::Index next = 0;
    if (!(left.maxCoeff(&next) > enough)) break;
    const auto k = static_cast<Eigen::Index>(chosen.size());
    along.col(k) =
        (ways.transpose() * ways.col(next) - along.leftCols(k) * along.row(next).head(k).transpose()) / std::sqrt(left[next]);
    left -= along.col(k).cwiseAbs2();
    left[next] = 0;
    chosen.push_back(known[static_cast<std::size_t>(next)]);
  }
  return chosen;
}

}  // namespace palpate
