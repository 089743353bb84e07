// Conjugate gradients for several right-hand sides side by side, in single precision, 3x3 block-Jacobi preconditioned:
//
//     A X = B,     A = c_m M + c_d D + c_k K at one state, rows and columns of held nodes those of the identity
//
// Each column has its own coefficients, and another takes its place as soon as it is done; what the columns share is the way
// through the matrix, which is what a product costs. A is not put together: a product goes over the elements (tangents.hpp), each
// of which reads two nodes and has five numbers of its own. Eight columns cost what one costs, to within the width of the
// processor's registers, and on a body that does not fit into the caches to within a tenth. Sums over nodes are in double
// precision and in a fixed order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/body/tangents.hpp"

namespace palpate {

/// A column: x holds the first guess and the answer.
struct SolveColumn {
  const Vector* b = nullptr;
  Vector* x = nullptr;
};

class BatchConjugateGradients {
 public:
  static constexpr int kColumns = 8;
  static constexpr double kTightest = 1e-5;  ///< of |b|: single precision gets no further

  /// The matrix, at the state of `tangents`; nothing of the arguments is kept.
  void prepare(const Tangents& tangents, double c_m, double c_d, double c_k, const std::vector<std::uint8_t>& held, bool clamp);
  /// |A x - b| <= max(tolerance, kTightest) |b| for each of any number of columns, as far as the recursion can tell. Rows of held
  /// nodes are taken for zero in b and are zero in x. Returns the iterations of all columns together. `positive_definite` becomes
  /// false, and the columns keep what was found so far, when a direction of non-positive curvature shows.
  int solve(std::span<const SolveColumn> columns, double tolerance, bool& positive_definite);

 private:
  struct alignas(32) Rows {  // what one node does in all columns
    float x[kColumns], y[kColumns], z[kColumns];
  };
  struct Element {
    float n[3], axial, across;
    std::uint32_t b;
  };
  struct Block {
    float xx, xy, xz, yy, yz, zz;
  };
  struct Lanes {  // one number a column
    double v[kColumns] = {};
  };

  bool load(const SolveColumn& column, int lane, double& scale);
  void unload(const SolveColumn& column, int lane, double scale) const;
  void multiply(const std::vector<Rows>& p, std::vector<Rows>& y) const;
  void advance(const Lanes& alpha, Lanes& rr, Lanes& rz);
  void turn(const Lanes& beta);
  static Lanes dot(const std::vector<Rows>& a, const std::vector<Rows>& b);

  float spatial_ = 1;  // 0 for a planar body: nothing couples its nodes across the plane
  std::vector<std::uint32_t> first_;
  std::vector<Element> elements_;
  std::vector<float> mass_, free_;  // c_m m; 0 for a held node, 1 for others
  std::vector<Block> inverse_;      // of the diagonal
  std::vector<Rows> x_, r_, z_, p_, ap_;
};

}  // namespace palpate
