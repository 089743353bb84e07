// P(s) = s^2 M + s D + K of a second-order system, factorised for any complex s; the pattern is analysed once.
#pragma once

#include "bench/paper/symmetric_factor.hpp"
#include "server/solve/block_matrix.hpp"

namespace palpate {

class DynamicStiffness {
 public:
  /// P(s) at one s.
  class At {
   public:
    /// Returns P(s)^-1 B, with one step of iterative refinement.
    ComplexMatrix solve(const ComplexMatrix& b) const;
    const Eigen::VectorXcd& pivots() const { return factor_.pivots(); }

   private:
    friend class DynamicStiffness;
    At(Eigen::SparseMatrix<Complex> matrix, std::shared_ptr<const SymmetricAnalysis> analysis);
    Eigen::SparseMatrix<Complex> matrix_;
    SymmetricFactor factor_;
  };

  DynamicStiffness(const Vector& mass, const SparseMatrix& damping, const SparseMatrix& stiffness);
  At at(Complex s) const;

 private:
  SparseMatrix mass_, damping_, stiffness_;  // all on one pattern
  std::shared_ptr<const SymmetricAnalysis> analysis_;
};

}  // namespace palpate
