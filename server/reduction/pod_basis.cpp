#include "server/reduction/pod_basis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr double kEnergyRounding = 1e-10;  // of the largest energy: well above the 1e-16 of doubles, summed over 3 N rows

/// W^T M W, W^T K W and W^T D W.
struct Grams {
  Matrix m, k, d;
};

Grams grams(const Linearisation& at, const Matrix& w) {
  assert(w.rows() == at.masses().size());
  Matrix k_w, d_w;
  at.body->multiply(w, k_w, d_w);
  return {w.transpose() * (at.masses().asDiagonal() * w), w.transpose() * k_w, w.transpose() * d_w};
}

/// Directions and their coefficients: V = W made.
struct Directions {
  Matrix v, made;
};

/// Returns the leading directions of the first columns of W, orthonormal in M.
Directions leading(const Vector& masses, const Matrix& w, const Matrix& energy, Eigen::Index most) {
  const Eigen::Index count = energy.cols();
  assert(energy.rows() == count && count <= w.cols() && most > 0);
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(energy);
  const double smallest = std::max(0.0, kEnergyRounding * eigen.eigenvalues().tail<1>()[0]);
  Eigen::Index r = std::min(most, count);
  while (r > 0 && !(eigen.eigenvalues()[count - r] > smallest)) --r;  // none if nothing moves
  // Scaled to energy 1, their products of masses are well conditioned: between the inverse square of the body's highest frequency
  // and 1/s^2.
  Directions found;
  found.made = Matrix::Zero(w.cols(), r);
  found.made.topRows(count) = eigen.eigenvectors().rightCols(r).rowwise().reverse() *
                              eigen.eigenvalues().tail(r).reverse().cwiseSqrt().cwiseInverse().asDiagonal();
  found.v = w.leftCols(count) * found.made.topRows(count);
  if (r > 0) {
    const Eigen::LLT<Matrix> factor(found.v.transpose() * (masses.asDiagonal() * found.v));
    factor.matrixU().solveInPlace<Eigen::OnTheRight>(found.v);
    factor.matrixU().solveInPlace<Eigen::OnTheRight>(found.made);
  }
  return found;
}

/// Appends column k of W, unless the directions span it already.
void append(const Vector& masses, const Matrix& w, Eigen::Index k, Directions& to) {
  Vector x = w.col(k), of_columns = Vector::Unit(w.cols(), k);
  const auto length = [&] { return std::sqrt(x.dot(masses.cwiseProduct(x))); };
  const double before = length();
  for (int again = 0; again < 2; ++again) {
    const Vector along = to.v.transpose() * masses.cwiseProduct(x);
    x -= to.v * along;
    of_columns -= to.made * along;
  }
  const double left = length();
  if (!(left > kIndependentShare * before)) return;
  for (auto& [matrix, column] : {std::pair{&to.v, &x}, std::pair{&to.made, &of_columns}}) {
    matrix->conservativeResize(Eigen::NoChange, matrix->cols() + 1);
    matrix->rightCols<1>() = *column / left;
  }
}

}  // namespace

PodBasis pod_basis(const Linearisation& at, const SnapshotSet& snapshots, std::span<const Vector> beside, double shift_1_s,
                   int modes) {
  const Eigen::Index count = snapshots.count(), more = static_cast<Eigen::Index>(beside.size());
  assert(count > 0 && more < modes);
  Matrix w(at.masses().size(), count + more);
  w.leftCols(count) = snapshots.weighted();
  for (Eigen::Index k = 0; k < more; ++k) w.col(count + k) = beside[static_cast<std::size_t>(k)];
  mask(*at.held, w);
  const Grams all = grams(at, w);
  const Matrix energy = (all.k + shift_1_s * all.d + shift_1_s * shift_1_s * all.m).topLeftCorner(count, count);
  Directions directions = leading(at.masses(), w, energy, modes - more);
  for (Eigen::Index k = count; k < w.cols(); ++k) append(at.masses(), w, k, directions);
  const Matrix& made = directions.made;
  PodBasis basis;
  basis.coordinates = made.transpose() * all.m.leftCols(count);
  basis.at_modes = {made.transpose() * all.k * made, made.transpose() * all.d * made};
  basis.modes = std::move(directions.v);
  return basis;
}

}  // namespace palpate
