// Sparse A = L D L^T of a complex symmetric matrix (A = A^T, not Hermitian), by the multifrontal method.
//
// The pattern is analysed once (minimum degree, elimination tree, columns of similar pattern joined into fronts); each set of
// values then costs dense arithmetic on the fronts. There is no pivoting. That is safe for s^2 M + s D + K with Re s > 0 and M,
// D, K symmetric and positive semi-definite: divided by s its real part is positive definite, and so are those of all its Schur
// complements. On the imaginary axis light damping lets entries grow; there the caller refines (dynamic_stiffness.hpp).
// Sources: Duff and Reid, ACM TOMS 9 (1983); Liu, SIAM Review 34 (1992).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <complex>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace palpate {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Complex = std::complex<double>;
using ComplexMatrix = Eigen::MatrixXcd;

/// The analysis of a pattern, independent of values. Indices inside are in the order of elimination.
struct SymmetricAnalysis {
  /// `pattern`: compressed, both triangles stored, the whole diagonal present.
  explicit SymmetricAnalysis(const SparseMatrix& pattern);

  struct Front {
    int first = 0, width = 0;   ///< columns that are eliminated in this front
    int parent = -1;            ///< front that receives the Schur complement
    std::vector<int> rows;      ///< rows below these columns, ascending
    std::vector<int> children;  ///< fronts whose Schur complements are added here
  };
  struct Entry {
    int row, source;  ///< lower-triangle row; index into the values of `pattern`
  };
  int size = 0;
  std::vector<int> original;  ///< index in the matrix for each index here
  std::vector<Front> fronts;  ///< children before parents
  std::vector<int> column_begin;
  std::vector<Entry> entries;  ///< by column
};

class SymmetricFactor {
 public:
  /// `values`: of the matrix, in the order of the pattern's value array.
  SymmetricFactor(std::shared_ptr<const SymmetricAnalysis> analysis, std::span<const Complex> values);

  /// Returns X = A^-1 B, for any number of columns.
  ComplexMatrix solve(const ComplexMatrix& b) const;
  /// Returns the diagonal of D, in the order of elimination: for a real matrix the signs are its inertia.
  const Eigen::VectorXcd& pivots() const { return pivots_; }

 private:
  std::shared_ptr<const SymmetricAnalysis> analysis_;
  std::vector<ComplexMatrix> panels_;  ///< columns of L, unit triangle on top, of each front
  Eigen::VectorXcd pivots_;
};

}  // namespace palpate
