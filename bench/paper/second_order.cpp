#include "bench/paper/second_order.hpp"

#include <Eigen/Cholesky>
#include <stdexcept>

namespace palpate {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr std::int64_t kNone = -1;

/// Computes products with the unit vectors of the node's three axes: columns of K and D.
void columns(const Dynamics& dynamics, const BodyState& state, std::uint32_t node, Matrix& k, Matrix& d) {
  const auto n = dynamics.masses().size();
  k.resize(n, 3);
  d.resize(n, 3);
  for (int axis = 0; axis < 3; ++axis) {
    Vector e = Vector::Zero(n), k_column, d_column;
    e[3 * static_cast<Eigen::Index>(node) + axis] = 1;
    dynamics.multiply_tangents(state, e, k_column, d_column);
    k.col(axis) = k_column;
    d.col(axis) = d_column;
  }
}

/// Returns true if an axis of a node has stiffness (or damping) beyond rounding.
bool pulled(const BlockMatrix::Block& diagonal, Eigen::Index axis) {
  constexpr double kRounding = 1e-10;
  return std::abs(diagonal(axis, axis)) > kRounding * diagonal.diagonal().cwiseAbs().maxCoeff();
}

/// Returns the free part of one of the body's matrices.
SparseMatrix restricted(const BlockMatrix& a, const std::vector<std::int64_t>& row_of, Eigen::Index n) {
  Triplets entries;
  for (std::uint32_t i = 0; i < a.rows(); ++i)
    for (std::uint32_t e = a.row_begin(i); e < a.row_end(i); ++e)
      for (std::uint32_t r = 0; r < 3; ++r)
        for (std::uint32_t c = 0; c < 3; ++c) {
          const std::int64_t row = row_of[3 * i + r], column = row_of[3 * a.column(e) + c];
          const double value = a.block(e)(r, c);
          if (row != kNone && column != kNone && value != 0)
            entries.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
        }
  SparseMatrix m(n, n);
  m.setFromTriplets(entries.begin(), entries.end());
  // Makes the matrix symmetric to the last bit, and drops entries that cancel in the sum over the elements.
  constexpr double kRounding = 1e-14;
  m = 0.5 * (m + SparseMatrix(m.transpose()));
  if (m.nonZeros() > 0) m.prune(m.coeffs().abs().maxCoeff(), kRounding);
  return m;
}

}  // namespace

namespace {

/// The part that both kinds of port share: the free coordinates with their M, D and K.
struct FreeBody {
  SecondOrderSystem system;
  std::vector<std::int64_t> row_of;
  std::vector<std::uint8_t> moves;  ///< per coordinate: 1 if it has stiffness or damping, held or not
};

FreeBody free_body(const Dynamics& dynamics, const BodyState& state, const std::vector<std::uint8_t>& held) {
  BlockMatrix k = dynamics.make_matrix(), d = dynamics.make_matrix();
  const std::vector<std::uint8_t> none(dynamics.nodes(), 0);
  dynamics.assemble(state, 0, 0, 1, none, false, k);
  dynamics.assemble(state, 0, 1, 0, none, false, d);
  FreeBody free;
  SecondOrderSystem& s = free.system;
  free.row_of.assign(3 * std::size_t{dynamics.nodes()}, kNone);
  free.moves.assign(free.row_of.size(), 0);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      if (dynamics.body().planar && axis == 2) continue;
      if (!pulled(k.block(k.diagonal(i)), at) && !pulled(d.block(d.diagonal(i)), at)) continue;
      free.moves[3 * i + axis] = 1;
      if (held[i]) continue;
      free.row_of[3 * i + axis] = static_cast<std::int64_t>(s.coordinates.size());
      s.coordinates.push_back(3 * i + axis);
    }
  const auto n = static_cast<Eigen::Index>(s.coordinates.size());
  s.mass.resize(n);
  for (Eigen::Index row = 0; row < n; ++row) s.mass[row] = dynamics.masses()[s.coordinates[static_cast<std::size_t>(row)]];
  s.stiffness = restricted(k, free.row_of, n);
  s.damping = restricted(d, free.row_of, n);
  return free;
}

std::vector<std::uint8_t> with_fixed(const Dynamics& dynamics, std::vector<std::uint8_t> held) {
  held.resize(dynamics.nodes(), 0);
  for (std::uint32_t i = 0; i < dynamics.nodes(); ++i)
    if (dynamics.body().fixed[i]) held[i] = 1;
  return held;
}

}  // namespace

SecondOrderSystem second_order_system(const Dynamics& dynamics, const BodyState& state, std::uint32_t port_node,
                                      std::vector<std::uint8_t> held) {
  held = with_fixed(dynamics, std::move(held));
  held[port_node] = 1;
  FreeBody free = free_body(dynamics, state, held);
  SecondOrderSystem& s = free.system;
  for (std::uint32_t axis = 0; axis < 3; ++axis)
    if (free.moves[3 * port_node + axis]) s.port_axes.push_back(axis);
  const Eigen::Index n = s.size(), p = static_cast<Eigen::Index>(s.port_axes.size());
  Matrix k_columns, d_columns;
  columns(dynamics, state, port_node, k_columns, d_columns);
  s.b_k.resize(n, p);
  s.b_d.resize(n, p);
  s.k_port.resize(p, p);
  s.d_port.resize(p, p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto axis = static_cast<Eigen::Index>(s.port_axes[static_cast<std::size_t>(j)]);
    for (Eigen::Index row = 0; row < n; ++row) {
      s.b_k(row, j) = -k_columns(s.coordinates[static_cast<std::size_t>(row)], axis);
      s.b_d(row, j) = -d_columns(s.coordinates[static_cast<std::size_t>(row)], axis);
    }
    for (Eigen::Index i = 0; i < p; ++i) {
      const Eigen::Index row = 3 * static_cast<Eigen::Index>(port_node) + s.port_axes[static_cast<std::size_t>(i)];
      s.k_port(i, j) = k_columns(row, axis);
      s.d_port(i, j) = d_columns(row, axis);
    }
  }
  return std::move(free.system);
}

SecondOrderSystem pushed_system(const Dynamics& dynamics, const BodyState& state, const Matrix& b,
                                std::vector<std::uint8_t> held) {
  FreeBody free = free_body(dynamics, state, with_fixed(dynamics, std::move(held)));
  SecondOrderSystem& s = free.system;
  s.port_axes = {0, 1, 2};
  if (dynamics.body().planar) s.port_axes.pop_back();
  const auto p = static_cast<Eigen::Index>(s.port_axes.size());
  s.b_k = b(s.coordinates, s.port_axes);
  s.b_d = Matrix::Zero(s.size(), p);
  s.k_port = s.d_port = Matrix::Zero(p, p);
  return std::move(free.system);
}

SecondOrderSystem project(const SecondOrderSystem& system, const Matrix& v) {
  // V^T M V = L L^T; W = V L^-T is orthonormal in M.
  const Matrix gram = v.transpose() * system.mass.asDiagonal() * v;
  const Eigen::LLT<Matrix> cholesky(0.5 * (gram + gram.transpose()));
  if (cholesky.info() != Eigen::Success) throw std::runtime_error("project: the columns of the basis are not independent");
  const Matrix w = cholesky.matrixL().solve(v.transpose()).transpose();
  SecondOrderSystem r;
  r.mass = Vector::Ones(w.cols());
  r.stiffness = Matrix(w.transpose() * (system.stiffness * w)).sparseView();
  r.damping = Matrix(w.transpose() * (system.damping * w)).sparseView();
  r.b_k = w.transpose() * system.b_k;
  r.b_d = w.transpose() * system.b_d;
  r.k_port = system.k_port;
  r.d_port = system.d_port;
  r.port_axes = system.port_axes;
  return r;
}

TransferFunction::TransferFunction(const SecondOrderSystem& system)
    : system_(&system), p_(system.mass, system.damping, system.stiffness) {}

ComplexMatrix TransferFunction::operator()(Complex s) const {
  const SecondOrderSystem& y = *system_;
  const ComplexMatrix b = y.b_k.cast<Complex>() + s * y.b_d.cast<Complex>();
  return y.k_port.cast<Complex>() + s * y.d_port.cast<Complex>() - b.transpose() * p_.at(s).solve(b);
}

}  // namespace palpate
