#include "server/elements/column_lanes.hpp"

#include <algorithm>
#include <array>

namespace palpate {

// Whole lines of memory at a time: what is missing of a matrix's last columns is read from a column of zeros, and written to one
// that is thrown away.

void pack_columns(const Eigen::Ref<const Eigen::MatrixXd>& from, Eigen::Index first, std::vector<NodeLanes>& to) {
  const Eigen::VectorXd none = first + kColumnLanes > from.cols() ? Eigen::VectorXd::Zero(from.rows()) : Eigen::VectorXd();
  std::array<const double*, kColumnLanes> columns;
  for (Eigen::Index c = 0; c < kColumnLanes; ++c)
    columns[static_cast<std::size_t>(c)] = first + c < from.cols() ? from.col(first + c).data() : none.data();
  std::size_t row = 0;
  for (NodeLanes& r : to) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      r.x[c] = columns[c][row];
      r.y[c] = columns[c][row + 1];
      r.z[c] = columns[c][row + 2];
    }
    row += 3;
  }
}

void unpack_columns(const std::vector<NodeLanes>& from, Eigen::Index first, Eigen::Ref<Eigen::MatrixXd> to) {
  Eigen::VectorXd rest(first + kColumnLanes > to.cols() ? to.rows() : 0);
  std::array<double*, kColumnLanes> columns;
  for (Eigen::Index c = 0; c < kColumnLanes; ++c)
    columns[static_cast<std::size_t>(c)] = first + c < to.cols() ? to.col(first + c).data() : rest.data();
  std::size_t row = 0;
  for (const NodeLanes& r : from) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      columns[c][row] = r.x[c];
      columns[c][row + 1] = r.y[c];
      columns[c][row + 2] = r.z[c];
    }
    row += 3;
  }
}

}  // namespace palpate
