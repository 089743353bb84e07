// Sparse non-negative least squares: w >= 0 with few entries that are not zero, and |A w - t| small.
//
// Greedy: the column whose direction has most of what is left, by the root of what it costs, joins (all are asked at every eighth
// join, between them those that then had most), the weights of all that have joined are found anew, and those that would be
// negative leave, until what is left is close enough, nothing fits any more, or no column has any of it. Source: Lawson and
// Hanson, Solving Least Squares Problems (1974), with the stop that Farhat et al. use, IJNME 98 (2014).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

struct SparseSolution {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXf weights;  ///< > 0, of these columns
  float left = 1;           ///< |A w - t| / |t|
};

/// What columns cost, which may depend on those that are there already.
class ColumnCosts {
 public:
  virtual ~ColumnCosts() = default;
  virtual void with(const std::vector<Eigen::Index>& there) = 0;
  /// > 0; infinite where there is no room.
  virtual float of(Eigen::Index column) const = 0;
};

/// At most `most` columns.
SparseSolution sparse_nnls(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most, float close_enough, ColumnCosts& costs);
/// Of all columns, but for those whose weights would not be positive.
SparseSolution positive_weights(const Eigen::MatrixXf& a, const Eigen::VectorXf& t);

}  // namespace palpate
