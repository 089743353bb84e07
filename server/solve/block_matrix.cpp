#include "server/solve/block_matrix.hpp"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

namespace palpate {

BlockPattern::BlockPattern(std::uint32_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs,
                           Triangles triangles) {
  std::vector<std::uint32_t> end(rows + 1, 1);  // of the neighbours of each row, which begin with itself
  for (const auto& [a, b] : pairs) {
    ++end[std::min(a, b)];
    if (triangles == Triangles::both) ++end[std::max(a, b)];
  }
  std::exclusive_scan(end.begin(), end.end(), end.begin(), 0U);
  std::vector<std::uint32_t> neighbours(end.back());
  const std::vector<std::uint32_t> begin = end;
  for (std::uint32_t i = 0; i < rows; ++i) neighbours[end[i]++] = i;
  for (const auto& [a, b] : pairs) {
    neighbours[end[std::min(a, b)]++] = std::max(a, b);
    if (triangles == Triangles::both) neighbours[end[std::max(a, b)]++] = std::min(a, b);
  }
  first_.assign(rows + 1, 0);
  diagonal_.resize(rows);
  columns_.reserve(neighbours.size());
  for (std::uint32_t i = 0; i < rows; ++i) {
    const auto of = std::span(neighbours).subspan(begin[i], end[i] - begin[i]), others = of.subspan(1);
    if (std::ranges::is_sorted(others))  // as those of ordered pairs are
      std::rotate(of.begin(), others.begin(), std::ranges::lower_bound(others, i));
    else
      std::ranges::sort(of);
    const auto past = std::unique(of.begin(), of.end());
    diagonal_[i] = first_[i] + static_cast<std::uint32_t>(std::lower_bound(of.begin(), past, i) - of.begin());
    columns_.insert(columns_.end(), of.begin(), past);
    first_[i + 1] = static_cast<std::uint32_t>(columns_.size());
  }
}

std::uint32_t BlockPattern::find(std::uint32_t row, std::uint32_t column) const {
  const auto begin = columns_.begin() + first_[row], end = columns_.begin() + first_[row + 1];
  return static_cast<std::uint32_t>(std::lower_bound(begin, end, column) - columns_.begin());
}

void BlockMatrix::widen(std::vector<Pair> pairs) {
  std::vector<Pair> missing;  // of both triangles
  for (const auto& [a, b] : pairs) {
    if (const std::uint32_t e = find(a, b); e < row_end(a) && column(e) == b) continue;
    missing.emplace_back(a, b);
    missing.emplace_back(b, a);
  }
  std::sort(missing.begin(), missing.end());
  const std::vector<std::uint32_t> first = std::exchange(first_, {0}), columns = std::exchange(columns_, {});
  const std::vector<double> values = std::exchange(values_, {});
  values_.reserve(values.size() + 9 * missing.size());
  columns_.reserve(columns.size() + missing.size());
  auto next = missing.begin();
  for (std::uint32_t i = 0; i + 1 < first.size(); ++i) {
    const auto add_until = [&](std::uint32_t column) {
      for (; next != missing.end() && next->first == i && next->second < column; ++next) {
        columns_.push_back(next->second);
        values_.insert(values_.end(), 9, 0.0);
      }
    };
    for (std::uint32_t e = first[i]; e < first[i + 1]; ++e) {
      add_until(columns[e]);
      if (columns[e] == i) diagonal_[i] = static_cast<std::uint32_t>(columns_.size());
      columns_.push_back(columns[e]);
      values_.insert(values_.end(), values.begin() + 9 * std::ptrdiff_t{e}, values.begin() + 9 * (std::ptrdiff_t{e} + 1));
    }
    add_until(0xffffffff);
    first_.push_back(static_cast<std::uint32_t>(columns_.size()));
  }
  widened_by_ = std::move(pairs);
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
