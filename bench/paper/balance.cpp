#include "bench/paper/balance.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

/// Returns the rounding error of an eigenvalue of Z^T S Z: the bound n eps |Z|^T |S| |Z| of its sums of n terms.
double rounding_of(const LowRankGramian& z, const SparseMatrix& damping) {
  const Matrix q = z.displacement.cwiseAbs(), v = z.velocity.cwiseAbs();
  const Matrix s_q = damping.cwiseAbs() * q + 2 * v;
  return static_cast<double>(2 * q.rows()) * std::numeric_limits<double>::epsilon() *
         q.cwiseProduct(s_q).colwise().sum().maxCoeff();
}

}  // namespace

BalancedReduction::BalancedReduction(const SecondOrderSystem& system, const BalanceOptions& options) {
  const SecondOrderSystem y = mass_scaled(system);
  const LowRankGramian z = low_rank_gramian(y, options);
  residual_ = z.residual;
  factorisations_ = z.factorisations;
  columns_ = static_cast<int>(z.displacement.cols());
  if (residual_ > options.residual)
    throw std::runtime_error("balance: the Gramian's residual is " + std::to_string(residual_) + " at " +
                             std::to_string(columns_) + " columns; the system is too lightly damped for so few");

  const Matrix cross = z.displacement.transpose() * z.velocity;
  const Matrix s = z.displacement.transpose() * (y.damping * z.displacement) + cross + cross.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(s);
  floor_ = std::max(rounding_of(z, y.damping), residual_ * eigen.eigenvalues().cwiseAbs().maxCoeff());
  std::vector<Eigen::Index> order(static_cast<std::size_t>(s.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const Vector size = eigen.eigenvalues().cwiseAbs();
  sort_stably(order.begin(), order.end(), [&](auto i, auto j) { return size[i] > size[j]; });
  std::erase_if(order, [&](auto i) { return size[i] <= floor_; });

  hankel_ = size(order);
  const Vector sign = eigen.eigenvalues()(order).cwiseSign();
  const Matrix turn = eigen.eigenvectors()(Eigen::all, order) * hankel_.cwiseSqrt().cwiseInverse().asDiagonal();
  const Matrix q = z.displacement * turn, v = z.velocity * turn;
  const Matrix s_a = v.transpose() * v - q.transpose() * (y.stiffness * q);
  balanced_.a = sign.asDiagonal() * s_a;
  balanced_.c = -y.b_k.transpose() * q - y.b_d.transpose() * v;
  balanced_.b = -(sign.asDiagonal() * balanced_.c.transpose());
  balanced_.d0 = y.k_port - y.b_d.transpose() * y.b_d;
  balanced_.d1 = y.d_port;
  const Vector scale = system.mass.cwiseSqrt().cwiseInverse();
  directions_.resize(2 * y.size(), hankel_.size());
  directions_ << scale.asDiagonal() * q, scale.asDiagonal() * v;
}

StateSpace BalancedReduction::truncated(int order) const {
  assert(order >= 0 && order <= states());
  StateSpace r = balanced_;
  r.a = balanced_.a.topLeftCorner(order, order);
  r.b = balanced_.b.topRows(order);
  r.c = balanced_.c.leftCols(order);
  return r;
}

int BalancedReduction::stable_order(int from) const {
  int order = from;
  while (order > 0 && order < states() && !(truncated(order).poles().real().maxCoeff() < 0)) ++order;
  return order;
}

double BalancedReduction::error_bound(int order) const {
  assert(order >= 0 && order <= states());
  const auto lost = std::max<Eigen::Index>(0, directions_.rows() - states());
  return 2 * (hankel_.tail(states() - order).sum() + static_cast<double>(lost) * floor_);
}

}  // namespace palpate
