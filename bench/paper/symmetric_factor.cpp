#include "bench/paper/symmetric_factor.hpp"

namespace palpate {
namespace {

/// Eliminates the first `width` columns of the lower triangle of `f`, in blocks: L below the diagonal, D on it.
void eliminate(ComplexMatrix& f, Eigen::Index width) {
  constexpr Eigen::Index kBlock = 48;
  const Eigen::Index n = f.rows();
  ComplexMatrix l_d;
  for (Eigen::Index k = 0; k < width; k += kBlock) {
    const Eigen::Index w = std::min(kBlock, width - k), rest = n - k - w;
    for (Eigen::Index j = k; j < k + w; ++j) {
      const Complex pivot = f(j, j);
      const Eigen::Index below = k + w - j - 1;
      for (Eigen::Index c = j + 1; c < k + w; ++c)
        f.col(c).segment(c, k + w - c) -= (f(c, j) / pivot) * f.col(j).segment(c, k + w - c);
      f.col(j).segment(j + 1, below) /= pivot;
    }
    if (rest == 0) continue;
    // Below the block: F = L D L_kk^T, so L = F L_kk^-T D^-1, and the rest loses L D L^T.
    auto panel = f.block(k + w, k, rest, w);
    f.block(k, k, w, w).triangularView<Eigen::UnitLower>().transpose().solveInPlace<Eigen::OnTheRight>(panel);
    l_d = panel;
    panel = panel * f.diagonal().segment(k, w).cwiseInverse().asDiagonal();
    f.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>() -= l_d * panel.transpose();
  }
}

}  // namespace

SymmetricFactor::SymmetricFactor(std::shared_ptr<const SymmetricAnalysis> analysis, std::span<const Complex> values)
    : analysis_(std::move(analysis)), panels_(analysis_->fronts.size()), pivots_(analysis_->size) {
  const SymmetricAnalysis& a = *analysis_;
  std::vector<int> local(static_cast<std::size_t>(a.size));
  std::vector<ComplexMatrix> left_over(a.fronts.size());
  for (std::size_t k = 0; k < a.fronts.size(); ++k) {
    const SymmetricAnalysis::Front& front = a.fronts[k];
    const int width = front.width, height = width + static_cast<int>(front.rows.size());
    for (int j = 0; j < width; ++j) local[static_cast<std::size_t>(front.first + j)] = j;
    for (std::size_t i = 0; i < front.rows.size(); ++i)
      local[static_cast<std::size_t>(front.rows[i])] = width + static_cast<int>(i);

    ComplexMatrix f = ComplexMatrix::Zero(height, height);
    for (int j = 0; j < width; ++j)
      for (int e = a.column_begin[static_cast<std::size_t>(front.first + j)];
           e < a.column_begin[static_cast<std::size_t>(front.first + j) + 1]; ++e) {
        const SymmetricAnalysis::Entry& entry = a.entries[static_cast<std::size_t>(e)];
        f(local[static_cast<std::size_t>(entry.row)], j) += values[static_cast<std::size_t>(entry.source)];
      }
    for (const int child : front.children) {
      const auto& rows = a.fronts[static_cast<std::size_t>(child)].rows;
      ComplexMatrix& from = left_over[static_cast<std::size_t>(child)];
      for (Eigen::Index c = 0; c < from.cols(); ++c) {
        const int column = local[static_cast<std::size_t>(rows[static_cast<std::size_t>(c)])];
        for (Eigen::Index r = c; r < from.rows(); ++r)
          f(local[static_cast<std::size_t>(rows[static_cast<std::size_t>(r)])], column) += from(r, c);
      }
      from.resize(0, 0);
    }
    eliminate(f, width);
    pivots_.segment(front.first, width) = f.diagonal().head(width);
    panels_[k] = f.leftCols(width);
    left_over[k] = f.bottomRightCorner(height - width, height - width);
  }
}

ComplexMatrix SymmetricFactor::solve(const ComplexMatrix& b) const {
  const SymmetricAnalysis& a = *analysis_;
  ComplexMatrix x = b(a.original, Eigen::all);
  for (std::size_t k = 0; k < a.fronts.size(); ++k) {
    const SymmetricAnalysis::Front& front = a.fronts[k];
    const ComplexMatrix& l = panels_[k];
    auto top = x.middleRows(front.first, front.width);
    l.topRows(front.width).triangularView<Eigen::UnitLower>().solveInPlace(top);
    if (!front.rows.empty()) {
      const ComplexMatrix change = l.bottomRows(l.rows() - front.width) * top;
      x(front.rows, Eigen::all) -= change;
    }
  }
  x = pivots_.cwiseInverse().asDiagonal() * x;
  for (std::size_t k = a.fronts.size(); k-- > 0;) {
    const SymmetricAnalysis::Front& front = a.fronts[k];
    const ComplexMatrix& l = panels_[k];
    auto top = x.middleRows(front.first, front.width);
    if (!front.rows.empty())
      top.noalias() -= l.bottomRows(l.rows() - front.width).transpose() * ComplexMatrix(x(front.rows, Eigen::all));
    l.topRows(front.width).transpose().triangularView<Eigen::UnitUpper>().solveInPlace(top);
  }
  ComplexMatrix y(x.rows(), x.cols());
  y(a.original, Eigen::all) = x;
  return y;
}

}  // namespace palpate
