#include "server/reduce/sparse_weights.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

/// The columns that have joined, and their products with all others.
class Joined {
 public:
  Joined(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most)
      : a_(a), with_t_(a.transpose() * t), products_(a.cols(), most + 1) {}

  const std::vector<Eigen::Index>& columns() const { return columns_; }
  const Eigen::VectorXf& weights() const { return weights_; }
  /// A^T (t - A w).
  Eigen::VectorXf left() const { return with_t_ - products_.leftCols(count()) * weights_; }
  /// t . A w, which is |A w|^2.
  float explained() const {
    float sum = 0;
    for (Eigen::Index k = 0; k < count(); ++k) sum += weights_[k] * with_t_[columns_[static_cast<std::size_t>(k)]];
    return sum;
  }
  void join(Eigen::Index column) {
    products_.col(count()).noalias() = a_.transpose() * a_.col(column);
    columns_.push_back(column);
  }
  /// False when the newest left again at once.
  bool settle() {
    const Eigen::Index newest = columns_.back();
    for (;;) {
      solve();
      Eigen::Index worst = 0;
      if (columns_.empty() || weights_.minCoeff(&worst) > 0) break;
      leave(worst);
    }
    return !columns_.empty() && std::find(columns_.begin(), columns_.end(), newest) != columns_.end();
  }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(columns_.size()); }
  void solve() {
    constexpr float kRidge = 1e-6F;  // of the mean: columns may be alike
    Eigen::MatrixXf gram(count(), count());
    Eigen::VectorXf b(count());
    for (Eigen::Index k = 0; k < count(); ++k) {
      for (Eigen::Index i = 0; i < count(); ++i) gram(i, k) = products_(columns_[static_cast<std::size_t>(i)], k);
      b[k] = with_t_[columns_[static_cast<std::size_t>(k)]];
    }
    if (count() > 0) gram.diagonal().array() += kRidge * gram.trace() / static_cast<float>(count());
    weights_ = gram.ldlt().solve(b);
  }
  void leave(Eigen::Index k) {
    columns_.erase(columns_.begin() + k);
    for (Eigen::Index i = k; i < count(); ++i) products_.col(i) = products_.col(i + 1);
  }

  const Eigen::MatrixXf& a_;
  Eigen::VectorXf with_t_;
  Eigen::MatrixXf products_;
  std::vector<Eigen::Index> columns_;
  Eigen::VectorXf weights_;
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
    joined.join(best);
    if (!joined.settle()) free[best] = 0;
    left = joined.left();
    missing = std::sqrt(std::max(0.0F, 1 - joined.explained() / all));
  }
  return {joined.columns(), joined.weights(), missing};
}

}  // namespace palpate
