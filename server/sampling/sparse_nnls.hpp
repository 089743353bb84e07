// Sparse non-negative least squares: w >= 0 with few nonzero entries such that |A w - t| is small.
//
// Greedy: the column whose direction has the largest component along the residual, relative to the root of its cost, joins (every
// eighth join searches all columns, those between only the best of the last search). The weights of all joined columns are fitted
// anew, and those that would be negative leave, until the residual is small enough, no room is left, or no column improves it.
// Source: Lawson and Hanson, Solving Least Squares Problems (1974), with the stopping rule of Farhat et al., IJNME 98 (2014).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

struct SparseSolution {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXf weights;  ///< > 0, parallel to `columns`
  float left = 1;           ///< residual |A w - t| / |t|
};

/// Costs of columns, which may depend on those that have joined.
class ColumnCosts {
 public:
  virtual ~ColumnCosts() = default;
  virtual void with(const std::vector<Eigen::Index>& there) = 0;
  /// Returns a cost > 0; infinite if there is no room.
  virtual float of(Eigen::Index column) const = 0;
};

/// Uses at most `most` columns.
SparseSolution sparse_nnls(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most, float close_enough, ColumnCosts& costs);
/// Fits all columns, except those whose weights would not be positive.
SparseSolution positive_weights(const Eigen::MatrixXf& a, const Eigen::VectorXf& t);

}  // namespace palpate
