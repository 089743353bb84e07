#include "server/reduce/spring_matrices.hpp"

namespace palpate {
namespace {

using Pair = SpringMatrices::Pair;
using Six = Eigen::Array<double, 6, 1>;

Six upper(const Mat3& m) {
  Six six;
  six << m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2);
  return six;
}

/// y += B x
[[gnu::always_inline]] inline void add_product(const double* b, const ColumnLanes (&x)[3], ColumnLanes (&y)[3]) {
  y[0] += b[0] * x[0] + b[1] * x[1] + b[2] * x[2];
  y[1] += b[1] * x[0] + b[3] * x[1] + b[4] * x[2];
  y[2] += b[2] * x[0] + b[4] * x[1] + b[5] * x[2];
}

[[gnu::always_inline]] inline void read(const NodeLanes& from, ColumnLanes (&x)[3]) {
  x[0] = lanes(from.x), x[1] = lanes(from.y), x[2] = lanes(from.z);
}

[[gnu::always_inline]] inline void write(const ColumnLanes (&x)[3], NodeLanes& to) {
  lanes(to.x) = x[0], lanes(to.y) = x[1], lanes(to.z) = x[2];
}

/// y = A x, six(e) the numbers of block e.
template <typename Numbers>
void multiply_symmetric(const BlockPattern& pattern, const Numbers& six, const std::vector<NodeLanes>& x,
                        std::vector<NodeLanes>& y) {
  std::fill(y.begin(), y.end(), NodeLanes{});
  for (std::uint32_t row = 0; row < pattern.rows(); ++row) {
    ColumnLanes own[3], sum[3];
    read(x[row], own);
    read(y[row], sum);
    add_product(six(pattern.row_begin(row)), own, sum);  // the diagonal
    for (std::uint32_t e = pattern.row_begin(row) + 1; e < pattern.row_end(row); ++e) {
      const double* const b = six(e);
      ColumnLanes other[3], there[3];
      read(x[pattern.column(e)], other);
      read(y[pattern.column(e)], there);
      add_product(b, other, sum);
      add_product(b, own, there);
      write(there, y[pattern.column(e)]);
    }
    write(sum, y[row]);
  }
}

}  // namespace

Pair SpringMatrices::tangents(const Element& element, const ElementState& s) {
  Pair pair;
  pair << upper(ElementKernel::stiffness_symmetric(s, false)), upper(ElementKernel::damping(element, s));
  return pair;
}

Pair SpringMatrices::clamping(const ElementState& s) {
  Pair pair = Pair::Zero();
  if (s.axial < 0)
    pair.head<6>() = upper(ElementKernel::stiffness_symmetric(s, true) - ElementKernel::stiffness_symmetric(s, false));
  return pair;
}

void SpringMatrices::assemble(double c_d, double c_k, BlockMatrix& sum) const {
  for (std::uint32_t e = 0; e < sum.block_count(); ++e) {
    const Six six = c_k * pairs_[e].head<6>() + c_d * pairs_[e].tail<6>();
    sum.block(e) << six[0], six[1], six[2], six[1], six[3], six[4], six[2], six[4], six[5];
  }
}

void SpringMatrices::multiply(const Matrix& y, Matrix& k_y, Matrix& d_y) const {
  k_y.resize(y.rows(), y.cols());
  d_y.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data(); }, in, out);
    unpack_columns(out, first, k_y);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return pairs_[e].data() + 6; }, in, out);
    unpack_columns(out, first, d_y);
  }
}

void SpringMatrices::multiply_sum(const Matrix& y, double c_k, double c_d, Matrix& sum) const {
  sum.resize(y.rows(), y.cols());
  std::vector<NodeLanes> in(pattern_.rows()), out(pattern_.rows());
  std::vector<Six> both(pairs_.size());
  for (std::size_t e = 0; e < pairs_.size(); ++e) both[e] = c_k * pairs_[e].head<6>() + c_d * pairs_[e].tail<6>();
  for (Eigen::Index first = 0; first < y.cols(); first += kColumnLanes) {
    pack_columns(y, first, in);
    multiply_symmetric(
        pattern_, [&](std::uint32_t e) { return both[e].data(); }, in, out);
    unpack_columns(out, first, sum);
  }
}

}  // namespace palpate
