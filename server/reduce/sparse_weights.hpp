// Sparse non-negative least squares: w >= 0 with few entries that are not zero, and |A w - t| small.
//
// Greedy: the column whose direction has most of what is left joins, the weights of all that have joined are found anew, and
// those that would be negative leave, until what is left is close enough, `most` have joined, or no column has any of it. Source:
// Lawson and Hanson, Solving Least Squares Problems (1974), with the stop that Farhat et al. use, IJNME 98 (2014).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

struct SparseWeights {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXf weights;  ///< > 0, of these columns
  float left = 1;           ///< |A w - t| / |t|
};

SparseWeights sparse_weights(const Eigen::MatrixXf& a, const Eigen::VectorXf& t, int most, float close_enough);

}  // namespace palpate
