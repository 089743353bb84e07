#include "server/operators/tangent_matrices.hpp"

#include <cassert>

namespace palpate {
namespace {

using Half = Eigen::Array<double, 9, 1>;

/// Computes y += B x.
[[gnu::always_inline]] inline void add_product(const double* b, const ColumnLanes (&x)[3], ColumnLanes (&y)[3]) {
  for (int r = 0; r < 3; ++r) y[r] += b[3 * r] * x[0] + b[3 * r + 1] * x[1] + b[3 * r + 2] * x[2];
}

/// Computes y += B^T x.
[[gnu::always_inline]] inline void add_transposed(const double* b, const ColumnLanes (&x)[3], ColumnLanes (&y)[3]) {
  for (int c = 0; c < 3; ++c) y[c] += b[c] * x[0] + b[3 + c] * x[1] + b[6 + c] * x[2];
}

[[gnu::always_inline]] inline void read(const NodeLanes& from, ColumnLanes (&x)[3]) {
  x[0] = lanes(from.x), x[1] = lanes(from.y), x[2] = lanes(from.z);
}

[[gnu::always_inline]] inline void write(const ColumnLanes (&x)[3], NodeLanes& to) {
  lanes(to.x) = x[0], lanes(to.y) = x[1], lanes(to.z) = x[2];
}

/// Computes y = A x, numbers(e) those of block e.
template <typename Numbers>
void multiply_symmetric(const BlockPattern& pattern, const Numbers& numbers, const std::vector<NodeLanes>& x,
                        std::vector<NodeLanes>& y) {
  std::fill(y.begin(), y.end(), NodeLanes{});
  for (std::uint32_t row = 0; row < pattern.rows(); ++row) {
    ColumnLanes own[3], sum[3];
    read(x[row], own);
    read(y[row], sum);
    add_product(numbers(pattern.row_begin(row)), own, sum);  // the diagonal
    for (std::uint32_t e = pattern.row_begin(row) + 1; e < pattern.row_end(row); ++e) {
      const double* const b = numbers(e);
      ColumnLanes other[3], there[3];
      read(x[pattern.column(e)], other);
      read(y[pattern.column(e)], there);
      add_product(b, other, sum);
      add_transposed(b, own, there);
      write(there, y[pattern.column(e)]);
    }
    write(sum, y[row]);
  }
}

}  // namespace

void TangentMatrices::assemble(double c_d, double c_k, BlockMatrix& sum) const {
  assert(sum.block_count() == pairs_.size());
  for (std::uint32_t e = 0; e < sum.block_count(); ++e) {
    const Half both = c_k * pairs_[e].head<9>() + c_d * pairs_[e].tail<9>();
    for (Eigen::Index n = 0; n < 9; ++n) sum.block(e)(n / 3, n % 3) = both[n];
  }
}

void TangentMatrices::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  assert(y.rows() == 3 * static_cast<Eigen::Index>(pattern_.rows()));
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data(); }, in, out);
    unpack_columns(out, first, k_y);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data() + 9; }, in, out);
    unpack_columns(out, first, d_y);
  }
}

void TangentMatrices::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  std::vector<Half> both(pairs_.size());
  for (std::size_t e = 0; e < pairs_.size(); ++e) both[e] = c_k * pairs_[e].head<9>() + c_d * pairs_[e].tail<9>();
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return both[e].data(); }, in, out);
    unpack_columns(out, first, sum);
  }
}

}  // namespace palpate
