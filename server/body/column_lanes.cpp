#include "server/body/column_lanes.hpp"

#include <algorithm>

namespace palpate {

void pack_columns(const Eigen::Ref<const Matrix>& from, Eigen::Index first, std::vector<NodeLanes>& to) {
  const Eigen::Index count = std::min<Eigen::Index>(kColumnLanes, from.cols() - first);
  std::fill(to.begin(), to.end(), NodeLanes{});
  for (Eigen::Index c = 0; c < count; ++c) {
    const double* column = from.col(first + c).data();
    for (NodeLanes& r : to) {
      r.x[c] = *column++;
      r.y[c] = *column++;
      r.z[c] = *column++;
    }
  }
}

void unpack_columns(const std::vector<NodeLanes>& from, Eigen::Index first, Eigen::Ref<Matrix> to) {
  const Eigen::Index count = std::min<Eigen::Index>(kColumnLanes, to.cols() - first);
  for (Eigen::Index c = 0; c < count; ++c) {
    double* column = to.col(first + c).data();
    for (const NodeLanes& r : from) {
      *column++ = r.x[c];
      *column++ = r.y[c];
      *column++ = r.z[c];
    }
  }
}

}  // namespace palpate
