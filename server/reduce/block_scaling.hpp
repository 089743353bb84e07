// How the stiffness of a block of elements changes with the number m of elements between its loaded face and its held end.
//
// A lattice has the same element everywhere, so the same block meshed more finely has more elements in series and more of them
// side by side. Seen from a small loaded face, in a body that widens towards its end, the elements lie in shells, j = 1 next to
// the face, each with a compliance w_d(j) relative to the first:
//
//     s_d(m) = 1 / W_d(m),      W_d(m) = sum_{j=1..m} w_d(j),      w_d(1) = 1,   w_d(j) = (c_d + a_d j)^-(d-1)   for j > 1
//
// d dimensions. In one, w = 1 and s = 1 / m: springs in series, exactly. In two, s falls like 1 / ln m, in three it tends to a
// constant: the force spreads, and far shells hardly yield (Flamant's half plane, Boussinesq's half space). c_d and a_d are
// fitted to lattices that were measured (bench/paper/block_stiffness.hpp, palpate-lab scaling; a test repeats it): largest
// singular value of the stiffness of a rigid box of one layer of cells around a node in the middle of a free face, with all nodes
// m elements further out held. The fit is within 2.5 % of the lattices for m up to 16 (two dimensions), 0.2 % for m up to 8
// (three).
//
// Where the body's own layers have fewer nodes than those of such a half space, free sides cut the shells, and their compliance
// grows in proportion: ShellCompliance.
// Why this block and not one loaded by a plate, whose law is m^(d-2): docs/decisions/0009-two-layer.md.
// Source: Cavusoglu and Tendick, section 5.2 and fig. 16, which prints neither the block's loading nor figures.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// w_d(j), dimension 1 to 3, j >= 1.
double shell_compliance(int dimension, int shell);

/// W_d(m) in a body whose layers of nodes around the contact are counted: sum of w_d(j) r_j with
///     r_j = (h_j / h_1) / (n_j / n_1),      n_j = nodes in the body's layers j and j + 1,   h_j = the same in a half space.
class ShellCompliance {
 public:
  /// `layer_nodes`: nodes of layer 0 (the contact), 1, 2, ...; layers past the last have as many as it. Fewer than three: nothing
  /// is cut.
  ShellCompliance(int dimension, const std::vector<int>& layer_nodes);
  /// A half space.
  explicit ShellCompliance(int dimension) : ShellCompliance(dimension, {}) {}
  /// W_d(m), m >= 0.
  double operator()(int elements) const;

 private:
  double cut(int shell) const;
  int dimension_;
  std::vector<int> layer_nodes_;
};

/// 1 when all elements of the body are parallel, 2 when they lie in parallel planes, else 3.
int dimension_of(const LumpedBody& body);

}  // namespace palpate
