#include "server/sampling/sparse_nnls.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>

namespace palpate {
namespace {

constexpr float kRidgeShare = 1e-6F;  // of the mean square of columns, which may be nearly equal: some ten roundings of a float

/// The columns that have joined, and the Cholesky factor L of their products: L L^T = A^T A + ridge.
class Joined {
 public:
  Joined(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most)
      : a_(a),
        t_(t),
        ridge_(kRidgeShare * a.squaredNorm() / static_cast<float>(a.cols())),
        rows_(a.rows(), most),
        products_(most, most),
        factor_(most, most),
        with_t_(most),
        forward_(most) {}

  const std::vector<Eigen::Index>& columns() const { return columns_; }
  const Eigen::VectorXf& weights() const { return weights_; }
  /// Returns t - A w.
  Eigen::VectorXf left() const { return t_ - rows_.leftCols(count()) * weights_; }
  /// Returns false if the newest column left again at once.
  bool join(Eigen::Index newest) {
    const Eigen::Index n = count();
    assert(n < rows_.cols() && newest >= 0 && newest < a_.cols());
    rows_.col(n) = a_.col(newest);
    products_.row(n).head(n + 1).noalias() = (rows_.leftCols(n + 1).transpose() * rows_.col(n)).transpose();
    with_t_[n] = rows_.col(n).dot(t_);
    columns_.push_back(newest);
    add_row(n);
    for (;;) {
      solve();
      Eigen::Index worst = 0;
      if (columns_.empty() || weights_.minCoeff(&worst) > 0) break;
      leave(worst);
    }
    return !columns_.empty() && columns_.back() == newest;
  }

 private:
  Eigen::Index count() const { return static_cast<Eigen::Index>(columns_.size()); }
  void leave(Eigen::Index worst) {
    columns_.erase(columns_.begin() + worst);
    for (Eigen::Index k = worst; k < count(); ++k) {
      rows_.col(k) = rows_.col(k + 1);
      with_t_[k] = with_t_[k + 1];
      for (Eigen::Index i = 0; i <= k; ++i) products_(k, i) = products_(k + 1, i < worst ? i : i + 1);
      add_row(k);
    }
  }
  /// Computes row k of L and of L^-1 A^T t.
  void add_row(Eigen::Index k) {
    Eigen::VectorXf row = products_.row(k).head(k).transpose();
    factor_.topLeftCorner(k, k).triangularView<Eigen::Lower>().solveInPlace(row);
    factor_.row(k).head(k) = row.transpose();
    factor_(k, k) = std::sqrt(std::max(products_(k, k) - row.squaredNorm(), 0.0F) + ridge_);
    forward_[k] = (with_t_[k] - row.dot(forward_.head(k))) / factor_(k, k);
  }
  void solve() {
    weights_ = forward_.head(count());
    factor_.topLeftCorner(count(), count()).transpose().triangularView<Eigen::Upper>().solveInPlace(weights_);
  }

  const Eigen::MatrixXf& a_;
  const Eigen::VectorXf& t_;
  float ridge_;
  std::vector<Eigen::Index> columns_;
  Eigen::MatrixXf rows_;      // A of the joined columns
  Eigen::MatrixXf products_;  // of each column with those before it
  Eigen::MatrixXf factor_;
  Eigen::VectorXf with_t_, forward_, weights_;
};

/// Components of columns along the residual, relative to the root of their costs. Most are too small to matter: all columns are
/// searched every kFullSearchEvery joins, in between only the leading ones.
class Candidates {
 public:
  Candidates(const Eigen::MatrixXf& a, const ColumnCosts& costs)
      : a_(a), costs_(costs), length_(a.colwise().norm().cwiseMax(1e-30F)), barred_(static_cast<std::size_t>(a.cols()), 0) {}
  void bar(Eigen::Index column) { barred_[static_cast<std::size_t>(column)] = 1; }
  void free(Eigen::Index column) { barred_[static_cast<std::size_t>(column)] = 0; }
  /// Returns the best column; -1 if none improves the fit.
  Eigen::Index best(const Eigen::VectorXf& left) {
    Eigen::Index found = -1;
    if (since_++ % kFullSearchEvery != 0) found = best_of_leaders(left);
    return found >= 0 ? found : best_of_all(left);
  }

 private:
  static constexpr int kFullSearchEvery = 8;      // joins; measured: 6 has the same fit and takes longer (docs/notebook.md, 30)
  static constexpr std::size_t kLeadersMax = 50;  // searched in between; measured: as good as all (docs/notebook.md, 24)

  float value(Eigen::Index k, float with_left) const {
    return with_left > 0 && !barred_[static_cast<std::size_t>(k)] ? with_left / (length_[k] * std::sqrt(costs_.of(k))) : 0;
  }
  Eigen::Index best_of_leaders(const Eigen::VectorXf& left) const {
    Eigen::Index best = -1;
    float most = 0;
    for (const Eigen::Index k : leaders_) {
      const float found = value(k, a_.col(k).dot(left));
      if (found > most) most = found, best = k;
    }
    return best;
  }
  Eigen::Index best_of_all(const Eigen::VectorXf& left) {
    const Eigen::VectorXf with_left = a_.transpose() * left;
    std::vector<std::pair<float, Eigen::Index>> values;
    for (Eigen::Index k = 0; k < a_.cols(); ++k)
      if (const float v = value(k, with_left[k]); v > 0) values.emplace_back(-v, k);
    const auto end = values.begin() + static_cast<std::ptrdiff_t>(std::min(kLeadersMax, values.size()));
    std::partial_sort(values.begin(), end, values.end());
    leaders_.clear();
    std::transform(values.begin(), end, std::back_inserter(leaders_), [](const auto& v) { return v.second; });
    since_ = 1;
    return leaders_.empty() ? -1 : leaders_.front();
  }

  const Eigen::MatrixXf& a_;
  const ColumnCosts& costs_;
  Eigen::RowVectorXf length_;
  std::vector<std::uint8_t> barred_;
  std::vector<Eigen::Index> leaders_;
  int since_ = 0;
};

}  // namespace

SparseSolution sparse_nnls(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most, float close_enough, ColumnCosts& costs) {
  assert(a.rows() == t.size() && most > 0 && close_enough >= 0);
  const float all = t.norm();
  if (!(all > 0)) return {};
  Joined joined(a, t, most);
  Candidates candidates(a, costs);
  Eigen::VectorXf left = t;
  float missing = 1;
  while (static_cast<int>(joined.columns().size()) < most && missing > close_enough) {
    costs.with(joined.columns());
    const Eigen::Index best = candidates.best(left);
    if (best < 0) break;
    const std::vector<Eigen::Index> before = joined.columns();
    candidates.bar(best);  // permanently if it leaves at once
    if (joined.join(best))
      for (const Eigen::Index k : before)
        if (std::find(joined.columns().begin(), joined.columns().end(), k) == joined.columns().end()) candidates.free(k);
    left = joined.left();
    missing = left.norm() / all;
  }
  return {joined.columns(), joined.weights(), missing};
}

SparseSolution positive_weights(const Eigen::MatrixXf& a, const Eigen::VectorXf& t) {
  assert(a.rows() == t.size());
  std::vector<Eigen::Index> columns(static_cast<std::size_t>(a.cols()));
  std::iota(columns.begin(), columns.end(), Eigen::Index{0});
  Eigen::MatrixXf products = a.transpose() * a;
  products.diagonal().array() += kRidgeShare * products.diagonal().mean();
  const Eigen::VectorXf with_t = a.transpose() * t;
  Eigen::VectorXf weights;
  while (!columns.empty()) {
    weights = products(columns, columns).llt().solve(with_t(columns));
    if (weights.minCoeff() > 0) break;
    std::vector<Eigen::Index> kept;
    for (std::size_t k = 0; k < columns.size(); ++k)
      if (weights[static_cast<Eigen::Index>(k)] > 0) kept.push_back(columns[k]);
    columns = std::move(kept);
  }
  if (columns.empty() || !(t.norm() > 0)) return {};
  return {columns, weights, (a(Eigen::all, columns) * weights - t).norm() / t.norm()};
}

}  // namespace palpate
