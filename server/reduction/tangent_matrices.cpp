#include "server/reduction/tangent_matrices.hpp"

#include <cassert>

namespace palpate {
namespace {

template <int kNumbers>
using Half = Eigen::Array<double, kNumbers, 1>;

/// Returns the index of row r and column c of a block among its numbers.
template <int kNumbers>
consteval int place(int r, int c) {
  constexpr int kSymmetricPlaces[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};  // of xx xy xz yy yz zz
  return kNumbers == 6 ? kSymmetricPlaces[3 * r + c] : 3 * r + c;
}

/// Computes y += B x.
template <int kNumbers>
[[gnu::always_inline]] inline void add_product(const double* b, const ColumnLanes (&x)[3], ColumnLanes (&y)[3]) {
  y[0] += b[place<kNumbers>(0, 0)] * x[0] + b[place<kNumbers>(0, 1)] * x[1] + b[place<kNumbers>(0, 2)] * x[2];
  y[1] += b[place<kNumbers>(1, 0)] * x[0] + b[place<kNumbers>(1, 1)] * x[1] + b[place<kNumbers>(1, 2)] * x[2];
  y[2] += b[place<kNumbers>(2, 0)] * x[0] + b[place<kNumbers>(2, 1)] * x[1] + b[place<kNumbers>(2, 2)] * x[2];
}

/// Computes y += B^T x.
template <int kNumbers>
[[gnu::always_inline]] inline void add_transposed(const double* b, const ColumnLanes (&x)[3], ColumnLanes (&y)[3]) {
  y[0] += b[place<kNumbers>(0, 0)] * x[0] + b[place<kNumbers>(1, 0)] * x[1] + b[place<kNumbers>(2, 0)] * x[2];
  y[1] += b[place<kNumbers>(0, 1)] * x[0] + b[place<kNumbers>(1, 1)] * x[1] + b[place<kNumbers>(2, 1)] * x[2];
  y[2] += b[place<kNumbers>(0, 2)] * x[0] + b[place<kNumbers>(1, 2)] * x[1] + b[place<kNumbers>(2, 2)] * x[2];
}

[[gnu::always_inline]] inline void read(const NodeLanes& from, ColumnLanes (&x)[3]) {
  x[0] = lanes(from.x), x[1] = lanes(from.y), x[2] = lanes(from.z);
}

[[gnu::always_inline]] inline void write(const ColumnLanes (&x)[3], NodeLanes& to) {
  lanes(to.x) = x[0], lanes(to.y) = x[1], lanes(to.z) = x[2];
}

/// Computes y = A x, numbers(e) those of block e.
template <int kNumbers, typename Numbers>
void multiply_symmetric(const BlockPattern& pattern, const Numbers& numbers, const std::vector<NodeLanes>& x,
                        std::vector<NodeLanes>& y) {
  std::fill(y.begin(), y.end(), NodeLanes{});
  for (std::uint32_t row = 0; row < pattern.rows(); ++row) {
    ColumnLanes own[3], sum[3];
    read(x[row], own);
    read(y[row], sum);
    add_product<kNumbers>(numbers(pattern.row_begin(row)), own, sum);  // the diagonal
    for (std::uint32_t e = pattern.row_begin(row) + 1; e < pattern.row_end(row); ++e) {
      const double* const b = numbers(e);
      ColumnLanes other[3], there[3];
      read(x[pattern.column(e)], other);
      read(y[pattern.column(e)], there);
      add_product<kNumbers>(b, other, sum);
      add_transposed<kNumbers>(b, own, there);
      write(there, y[pattern.column(e)]);
    }
    write(sum, y[row]);
  }
}

}  // namespace

template <int kNumbers>
void TangentMatrices<kNumbers>::assemble(double c_d, double c_k, BlockMatrix& sum) const {
  assert(sum.block_count() == pairs_.size());
  for (std::uint32_t e = 0; e < sum.block_count(); ++e) {
    const Half<kNumbers> both = c_k * pairs_[e].template head<kNumbers>() + c_d * pairs_[e].template tail<kNumbers>();
    sum.block(e) << both[place<kNumbers>(0, 0)], both[place<kNumbers>(0, 1)], both[place<kNumbers>(0, 2)],
        both[place<kNumbers>(1, 0)], both[place<kNumbers>(1, 1)], both[place<kNumbers>(1, 2)], both[place<kNumbers>(2, 0)],
        both[place<kNumbers>(2, 1)], both[place<kNumbers>(2, 2)];
  }
}

template <int kNumbers>
void TangentMatrices<kNumbers>::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  assert(y.rows() == 3 * static_cast<Eigen::Index>(pattern_.rows()));
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric<kNumbers>(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data(); }, in, out);
    unpack_columns(out, first, k_y);
    multiply_symmetric<kNumbers>(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data() + kNumbers; }, in, out);
    unpack_columns(out, first, d_y);
  }
}

template <int kNumbers>
void TangentMatrices<kNumbers>::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  std::vector<Half<kNumbers>> both(pairs_.size());
  for (std::size_t e = 0; e < pairs_.size(); ++e)
    both[e] = c_k * pairs_[e].template head<kNumbers>() + c_d * pairs_[e].template tail<kNumbers>();
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric<kNumbers>(
        pattern_, [&](std::uint32_t e) { return both[e].data(); }, in, out);
    unpack_columns(out, first, sum);
  }
}

template class TangentMatrices<6>;
template class TangentMatrices<9>;

}  // namespace palpate
