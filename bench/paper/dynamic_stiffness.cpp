#include "bench/paper/dynamic_stiffness.hpp"

namespace palpate {
namespace {

SparseMatrix diagonal(const Vector& d) {
  SparseMatrix m(d.size(), d.size());
  m.reserve(Eigen::VectorXi::Ones(d.size()));
  for (Eigen::Index i = 0; i < d.size(); ++i) m.insert(i, i) = d[i];
  m.makeCompressed();
  return m;
}

std::span<const Complex> values_of(const Eigen::SparseMatrix<Complex>& m) {
  return {m.valuePtr(), static_cast<std::size_t>(m.nonZeros())};
}

}  // namespace

// A sum keeps the zeros of its terms, so all three get the union of the patterns.
DynamicStiffness::DynamicStiffness(const Vector& mass, const SparseMatrix& damping, const SparseMatrix& stiffness)
    : mass_(diagonal(mass) + 0.0 * damping + 0.0 * stiffness),
      damping_(0.0 * mass_ + damping + 0.0 * stiffness),
      stiffness_(0.0 * mass_ + 0.0 * damping + stiffness),
      analysis_(std::make_shared<SymmetricAnalysis>(stiffness_)) {}

DynamicStiffness::At DynamicStiffness::at(Complex s) const {
  Eigen::SparseMatrix<Complex> p = stiffness_.cast<Complex>();
  using Values = Eigen::Map<const Eigen::ArrayXd>;
  const auto count = stiffness_.nonZeros();
  Eigen::Map<Eigen::ArrayXcd>(p.valuePtr(), count) +=
      s * s * Values(mass_.valuePtr(), count) + s * Values(damping_.valuePtr(), count);
  return {std::move(p), analysis_};
}

DynamicStiffness::At::At(Eigen::SparseMatrix<Complex> matrix, std::shared_ptr<const SymmetricAnalysis> analysis)
    : matrix_(std::move(matrix)), factor_(std::move(analysis), values_of(matrix_)) {}

ComplexMatrix DynamicStiffness::At::solve(const ComplexMatrix& b) const {
  ComplexMatrix x = factor_.solve(b);
  x += factor_.solve(b - matrix_ * x);
  return x;
}

}  // namespace palpate
