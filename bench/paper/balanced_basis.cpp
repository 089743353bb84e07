#include "bench/paper/balanced_basis.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "server/body/dynamics.hpp"
#include "server/reduction/basis.hpp"
#include "server/reduction/snapshot_set.hpp"

namespace palpate {
namespace {

// BalanceOptions::residual; for touch: a contact moves on before more accuracy matters, and every step costs a solve per vertex.
constexpr double kGraspAdiResidual = 1e-8, kTouchAdiResidual = 1e-6;
constexpr double kDiscount_1_s = 5;              // more: stable sooner, and less accurate for lasting motion
constexpr std::size_t kVertexResponsesMax = 96;  // bounds memory: each has 3 N rows; when full, all are dropped

/// Multiplies the responses by exp(-a t): s -> s + a.
void discount(SecondOrderSystem& y, double a) {
  assert(a > 0);
  const SparseMatrix mass = SparseMatrix(Matrix(y.mass.asDiagonal()).sparseView());
  y.stiffness = y.stiffness + a * y.damping + a * a * mass;
  y.damping = y.damping + 2 * a * mass;
  y.b_k += a * y.b_d;
}

/// Appends the columns of `y` to the orthonormal columns `v`, in order.
void add_columns(const Matrix& y, Matrix& v) {
  for (Eigen::Index c = 0; c < y.cols() && v.cols() < BalancedBases::kColumns; ++c) {
    Vector next = y.col(c);
    const double before = next.norm();
    for (int pass = 0; pass < 2; ++pass) next -= v * (v.transpose() * next);
    if (!(next.norm() > kIndependentShare * before)) continue;
    v.conservativeResize(Eigen::NoChange, v.cols() + 1);
    v.rightCols(1) = next.normalized();
  }
}

/// Returns Y U with the eigenvectors U of Y^T Y, the largest first: the leading eigenvectors of Y Y^T, not normalised.
Matrix leading(const Matrix& y) {
  if (y.cols() == 0) return y;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(y.transpose() * y);
  constexpr double kEigenvalueRounding = 1e-13;  // of the largest: sums of products in doubles are accurate to some 1e-16 of it
  const Eigen::Index usable = (eigen.eigenvalues().array() > kEigenvalueRounding * eigen.eigenvalues().maxCoeff()).count();
  return y * eigen.eigenvectors().rightCols(std::min<Eigen::Index>(usable, BalancedBases::kColumns)).rowwise().reverse();
}

}  // namespace

BalancedBases::Response BalancedBases::respond(SecondOrderSystem system, double residual, CachedPatch& kept) const {
  const Eigen::Index rows = dynamics_->masses().size();
  if (system.b_k.isZero(0) && system.b_d.isZero(0))  // all nodes that the port moves are fixed
    return {Matrix::Zero(rows, system.ports()), Matrix::Zero(rows, 0)};
  SecondOrderSystem y = mass_scaled(system);
  if (!kept.still) kept.still = DynamicStiffness(y.mass, y.damping, y.stiffness).at(0);
  const Matrix q_s = kept.still->solve(y.b_k.cast<Complex>()).real();
  y.b_k = y.b_d - y.damping * q_s;
  y.b_d = -q_s;
  const LowRankGramian z = low_rank_gramian(y, {.residual = residual}, &kept.shifts);
  Response r{Matrix::Zero(rows, q_s.cols()), Matrix::Zero(rows, z.displacement.cols())};
  r.statics(system.coordinates, Eigen::all) = q_s;
  r.factor(system.coordinates, Eigen::all) = z.displacement;
  return r;
}

Matrix BalancedBases::basis(const Response& response) const {
  Matrix v(response.statics.rows(), 0);
  add_columns(leading(response.statics), v);
  add_columns(leading(response.factor - v * (v.transpose() * response.factor)), v);
  return dynamics_->masses().cwiseSqrt().cwiseInverse().asDiagonal() * v;
}

const Matrix& BalancedBases::grasped(std::uint32_t node) {
  const auto known = grasped_.find(node);
  if (known != grasped_.end()) return known->second;
  SecondOrderSystem system = second_order_system(*dynamics_, *rest_, node, {});
  Matrix v;
  try {
    CachedPatch once;
    v = basis(respond(system, kGraspAdiResidual, once));
  } catch (const std::runtime_error&) {
    discount(system, kDiscount_1_s);
    CachedPatch once;
    v = basis(respond(system, kGraspAdiResidual, once));
  }
  return grasped_[node] = std::move(v);
}

const BalancedBases::Response& BalancedBases::vertex_response(std::uint32_t vertex) {
  const auto known = vertices_.find(vertex);
  if (known != vertices_.end()) return known->second;
  if (vertices_.size() >= kVertexResponsesMax) vertices_.clear();
  Matrix b = Matrix::Zero(dynamics_->masses().size(), 3);
  for (const auto& [node, weight] : skin_->vertex_weights(vertex))
    b.middleRows<3>(3 * static_cast<Eigen::Index>(node)) += weight * Mat3::Identity();
  SecondOrderSystem system = pushed_system(*dynamics_, *rest_, b, {});
  if (discounted_) discount(system, kDiscount_1_s);
  try {
    return vertices_[vertex] = respond(system, kTouchAdiResidual, kept_);
  } catch (const std::runtime_error&) {
    if (discounted_) throw;
    discounted_ = true;
    kept_ = {};
    return vertex_response(vertex);
  }
}

Matrix BalancedBases::touched(const SurfacePoint& point) {
  assert(point.triangle < skin_->view().triangles.size());
  const Triangle& corners = skin_->view().triangles[point.triangle];
  for (const std::uint32_t corner : corners) vertex_response(corner);
  Response sum;
  for (std::size_t k = 0; k < 3; ++k) {
    const Response& r = vertex_response(corners[k]);
    const double weight = point.weight[static_cast<Eigen::Index>(k)];
    sum.statics = k == 0 ? Matrix(weight * r.statics) : Matrix(sum.statics + weight * r.statics);
    sum.factor = k == 0 ? Matrix(weight * r.factor) : Matrix(sum.factor + weight * r.factor);
  }
  return basis(sum);
}

Matrix restricted_basis(const Matrix& basis, Eigen::Index columns, const Vector& masses, const std::vector<std::uint8_t>& held) {
  assert(columns > 0 && basis.rows() == masses.size() && masses.minCoeff() > 0);
  Matrix v = basis.leftCols(std::min(columns, basis.cols()));
  mask(held, v);
  const Eigen::LLT<Matrix> cholesky(v.transpose() * masses.asDiagonal() * v);
  return cholesky.matrixL().solve(v.transpose()).transpose();
}

}  // namespace palpate
