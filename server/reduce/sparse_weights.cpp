#include "server/reduce/sparse_weights.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// The columns that have joined, and the Cholesky factor L of their products: L L^T = A^T A + ridge.
class Joined {
 public:
  Joined(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most)
      : a_(a),
        with_t_(a.transpose() * t),
        ridge_(kRidge * a.squaredNorm() / static_cast<float>(a.cols())),
        products_(a.cols(), most),
        factor_(most, most),
        forward_(most) {}

  const std::vector<Eigen::Index>& columns() const { return columns_; }
  const Eigen::VectorXf& weights() const { return weights_; }
  /// A^T (t - A w).
  Eigen::VectorXf left() const { return with_t_ - products_.leftCols(count()) * weights_; }
  /// t . A w, which is |A w|^2.
  float explained() const {
    float sum = 0;
    for (Eigen::Index k = 0; k < count(); ++k) sum += weights_[k] * with_t_[column(k)];
    return sum;
  }
  /// False when the newest left again at once.
  bool join(Eigen::Index newest) {
    products_.col(count()).noalias() = a_.transpose() * a_.col(newest);
    columns_.push_back(newest);
    add_row(count() - 1);
    for (;;) {
      solve();
      Eigen::Index worst = 0;
      if (columns_.empty() || weights_.minCoeff(&worst) > 0) break;
      columns_.erase(columns_.begin() + worst);
      for (Eigen::Index k = worst; k < count(); ++k) {
        products_.col(k) = products_.col(k + 1);
        add_row(k);
      }
    }
    return !columns_.empty() && columns_.back() == newest;
  }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(columns_.size()); }
  Eigen::Index column(Eigen::Index k) const { return columns_[static_cast<std::size_t>(k)]; }
  /// Row k of L and of L^-1 A^T t.
  void add_row(Eigen::Index k) {
    Eigen::VectorXf row(k);
    for (Eigen::Index i = 0; i < k; ++i) row[i] = products_(column(i), k);
    factor_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(row);
    factor_.row(k).head(k) = row.transpose();
    factor_(k, k) = std::sqrt(std::max(products_(column(k), k) - row.squaredNorm(), 0.0F) + ridge_);
    forward_[k] = (with_t_[column(k)] - row.dot(forward_.head(k))) / factor_(k, k);
  }
  void solve() {
    weights_ = forward_.head(count());
    factor_.topLeftCorner(count(), count()).transpose().triangularView<Eigen::Upper>().solveInPlace(weights_);
  }

  static constexpr float kRidge = 1e-6F;  ///< of the mean: columns may be alike
  const Eigen::MatrixXf& a_;
  Eigen::VectorXf with_t_;  ///< A^T t
  float ridge_;
  std::vector<Eigen::Index> columns_;
  Eigen::MatrixXf products_;  ///< of A with those that have joined
  Eigen::MatrixXf factor_;
  Eigen::VectorXf forward_, weights_;
};

}  // namespace

SparseWeights sparse_weights(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most, float close_enough) {
  const float all = t.squaredNorm();
  if (!(all > 0)) return {};
  const Eigen::VectorXf lengths = a.colwise().norm().transpose().cwiseMax(1e-30F);
  Joined joined(a, t, most);
  Eigen::VectorXf free = Eigen::VectorXf::Ones(a.cols());  // 0 for those that left at once
  Eigen::VectorXf left = joined.left();
  float missing = 1;
  while (static_cast<int>(joined.columns().size()) < most && missing > close_enough) {
    left = left.cwiseProduct(free).cwiseQuotient(lengths);
    for (const Eigen::Index k : joined.columns()) left[k] = 0;
    Eigen::Index best = 0;
    if (!(left.maxCoeff(&best) > 0)) break;
    if (!joined.join(best)) free[best] = 0;
    left = joined.left();
    missing = std::sqrt(std::max(0.0F, 1 - joined.explained() / all));
  }
  return {joined.columns(), joined.weights(), missing};
}

}  // namespace palpate
