#include "server/reduce/balanced_basis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

#include "server/body/dynamics.hpp"

namespace palpate {
namespace {

constexpr double kGraspResidual = 1e-8;
/// A contact moves on before more matters, and every step costs a solve a vertex.
constexpr double kTouchResidual = 1e-6;
constexpr double kDiscount = 5;  ///< [1/s]
constexpr std::size_t kFactorsMax = 96;

/// Responses times exp(-a t): s -> s + a.
void discount(SecondOrderSystem& y, double a) {
  const SparseMatrix mass = SparseMatrix(Matrix(y.mass.asDiagonal()).sparseView());
  y.stiffness = y.stiffness + a * y.damping + a * a * mass;
  y.damping = y.damping + 2 * a * mass;
  y.b_k += a * y.b_d;
}

/// Leading eigenvectors of Y Y^T, divided by M^1/2.
Matrix leading(const Matrix& y, const Vector& masses) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(y.transpose() * y);
  constexpr double kRounding = 1e-14;
  const Eigen::Index usable = (eigen.eigenvalues().array() > kRounding * eigen.eigenvalues().maxCoeff()).count();
  const Eigen::Index columns = std::min<Eigen::Index>(usable, BalancedBases::kColumns);
  Matrix v = y * eigen.eigenvectors().rightCols(columns).rowwise().reverse();
  for (Eigen::Index c = 0; c < columns; ++c) {
    for (int pass = 0; pass < 2; ++pass) v.col(c) -= v.leftCols(c) * (v.leftCols(c).transpose() * v.col(c));
    v.col(c).normalize();
  }
  return masses.cwiseSqrt().cwiseInverse().asDiagonal() * v;
}

}  // namespace

Matrix BalancedBases::displacement_factor(SecondOrderSystem system, ShiftMemory* memory) {
  const BalanceOptions options{.residual = memory ? kTouchResidual : kGraspResidual};
  LowRankGramian z;
  try {
    z = low_rank_gramian(mass_scaled(system), options, memory);
  } catch (const std::runtime_error&) {
    discount(system, kDiscount);
    z = low_rank_gramian(mass_scaled(system), options, memory);
  }
  Matrix y = Matrix::Zero(dynamics_->masses().size(), z.displacement.cols());
  y(system.coordinates, Eigen::all) = z.displacement;
  return y;
}

const Matrix& BalancedBases::grasped(std::uint32_t node) {
  const auto known = grasped_.find(node);
  if (known != grasped_.end()) return known->second;
  const Matrix y = displacement_factor(second_order_system(*dynamics_, *rest_, node, {}), nullptr);
  return grasped_[node] = leading(y, dynamics_->masses());
}

const Matrix& BalancedBases::vertex_factor(std::uint32_t vertex) {
  const auto known = factors_.find(vertex);
  if (known != factors_.end()) return known->second;
  if (factors_.size() >= kFactorsMax) factors_.clear();
  Matrix b = Matrix::Zero(dynamics_->masses().size(), 3);
  for (const auto& [node, weight] : skin_->vertex_weights(vertex))
    b.middleRows<3>(3 * static_cast<Eigen::Index>(node)) += weight * Mat3::Identity();
  return factors_[vertex] = displacement_factor(pushed_system(*dynamics_, *rest_, b, {}), &shifts_);
}

Matrix BalancedBases::touched(const SurfacePoint& point) {
  const Triangle& corners = skin_->view().triangles[point.triangle];
  Matrix y = point.weight[0] * vertex_factor(corners[0]);
  for (std::size_t k = 1; k < 3; ++k) y += point.weight[static_cast<Eigen::Index>(k)] * vertex_factor(corners[k]);
  return leading(y, dynamics_->masses());
}

Matrix restricted_basis(const Matrix& basis, Eigen::Index columns, const Vector& masses, const std::vector<std::uint8_t>& held) {
  Matrix v = basis.leftCols(std::min(columns, basis.cols()));
  for (std::size_t i = 0; i < held.size(); ++i)
    if (held[i]) v.middleRows<3>(3 * static_cast<Eigen::Index>(i)).setZero();
  const Eigen::LLT<Matrix> cholesky(v.transpose() * masses.asDiagonal() * v);
  return cholesky.matrixL().solve(v.transpose()).transpose();
}

}  // namespace palpate
