#include "server/reduction/snapshot_set.hpp"

#include <cassert>

namespace palpate {

std::vector<Eigen::Index> SnapshotSet::of(SnapshotKind kind) const {
  std::vector<Eigen::Index> columns;
  for (std::size_t k = 0; k < all_.size(); ++k)
    if (all_[k].kind == kind) columns.push_back(static_cast<Eigen::Index>(k));
  return columns;
}

std::vector<Eigen::Index> SnapshotSet::likeliest() const {
  std::vector<Eigen::Index> indentations = of(SnapshotKind::indentation);
  if (indentations.empty()) return of(SnapshotKind::port_response);
  std::vector<Eigen::Index> ends = of(SnapshotKind::rollout_end);
  return ends.empty() ? indentations : ends;
}

Matrix SnapshotSet::weighted() const {
  assert(!all_.empty());
  Matrix w(all_.front().state.size(), count());
  for (std::size_t k = 0; k < all_.size(); ++k) w.col(static_cast<Eigen::Index>(k)) = all_[k].weight * all_[k].state;
  return w;
}

void mask(const std::vector<std::uint8_t>& held, Matrix& columns) {
  assert(columns.rows() == 3 * static_cast<Eigen::Index>(held.size()));
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i]) columns.middleRows<3>(3 * static_cast<Eigen::Index>(i)).setZero();
}

}  // namespace palpate
