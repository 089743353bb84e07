// Four columns of a matrix over the nodes side by side, as vector instructions take them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/doubles.hpp"

namespace palpate {

inline constexpr int kColumnLanes = 4;
using ColumnLanes = Doubles<kColumnLanes>;

/// Rows x, y, z of one node in that many columns.
struct alignas(sizeof(ColumnLanes)) NodeLanes {
  double x[kColumnLanes], y[kColumnLanes], z[kColumnLanes];
};

[[gnu::always_inline]] inline ColumnLanes& lanes(double (&numbers)[kColumnLanes]) { return doubles<kColumnLanes>(numbers); }
[[gnu::always_inline]] inline const ColumnLanes& lanes(const double (&numbers)[kColumnLanes]) {
  return doubles<kColumnLanes>(numbers);
}

/// Columns first ... first + kColumnLanes - 1 of 3 N rows, zero beyond the last.
void pack_columns(const Eigen::Ref<const Eigen::MatrixXd>& from, Eigen::Index first, std::vector<NodeLanes>& to);
void unpack_columns(const std::vector<NodeLanes>& from, Eigen::Index first, Eigen::Ref<Eigen::MatrixXd> to);

}  // namespace palpate
