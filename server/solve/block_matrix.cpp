#include "server/solve/block_matrix.hpp"

#include <algorithm>

namespace palpate {

BlockPattern::BlockPattern(std::uint32_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs,
                           Triangles triangles) {
  std::vector<std::vector<std::uint32_t>> neighbours(rows);
  for (std::uint32_t i = 0; i < rows; ++i) neighbours[i].push_back(i);
  for (const auto& [a, b] : pairs) {
    neighbours[std::min(a, b)].push_back(std::max(a, b));
    if (triangles == Triangles::both) neighbours[std::max(a, b)].push_back(std::min(a, b));
  }
  first_.assign(rows + 1, 0);
  diagonal_.resize(rows);
  for (std::uint32_t i = 0; i < rows; ++i) {
    auto& row = neighbours[i];
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    diagonal_[i] = first_[i] + static_cast<std::uint32_t>(std::lower_bound(row.begin(), row.end(), i) - row.begin());
    columns_.insert(columns_.end(), row.begin(), row.end());
    first_[i + 1] = static_cast<std::uint32_t>(columns_.size());
  }
}

std::uint32_t BlockPattern::find(std::uint32_t row, std::uint32_t column) const {
  const auto begin = columns_.begin() + first_[row], end = columns_.begin() + first_[row + 1];
  return static_cast<std::uint32_t>(std::lower_bound(begin, end, column) - columns_.begin());
}

void BlockMatrix::multiply(const Vector& x, Vector& y) const {
  y.resize(x.size());
  const double* values = values_.data();
  for (std::uint32_t i = 0; i < rows(); ++i) {
    double s0 = 0, s1 = 0, s2 = 0;
    for (std::uint32_t e = row_begin(i); e < row_end(i); ++e, values += 9) {
      const double* p = x.data() + 3 * std::size_t{column(e)};
      s0 += values[0] * p[0] + values[1] * p[1] + values[2] * p[2];
      s1 += values[3] * p[0] + values[4] * p[1] + values[5] * p[2];
      s2 += values[6] * p[0] + values[7] * p[1] + values[8] * p[2];
    }
    y[3 * i] = s0;
    y[3 * i + 1] = s1;
    y[3 * i + 2] = s2;
  }
}

}  // namespace palpate
