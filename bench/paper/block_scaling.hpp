// The stiffness of a block of elements as a function of the number m of elements between its loaded face and its held end.
//
// A lattice has the same element everywhere, so a finer mesh of the same block has more elements in series and more in parallel.
// Seen from a small loaded face, in a body that widens towards its end, the elements form shells, j = 1 next to the face, each
// with a compliance w_d(j) relative to the first:
//
//     s_d(m) = 1 / W_d(m),      W_d(m) = sum_{j=1..m} w_d(j),      w_d(1) = 1,   w_d(j) = (c_d + a_d j)^-(d-1)   for j > 1
//
// d is the number of dimensions. In one, w = 1 and s = 1 / m: springs in series, exactly. In two, s falls like 1 / ln m, in three
// it tends to a constant: the force spreads, and far shells hardly yield (Flamant's half plane, Boussinesq's half space). c_d and
// a_d are fitted to measured lattices (bench/paper/block_stiffness.hpp; a test repeats it): the largest
// singular value of the stiffness of a rigid box of one layer of cells around a node in the middle of a free face, with all nodes
// m elements further out held. The fit is within 2.5 % of the lattices for m up to 16 (two dimensions), 0.2 % for m up to 8
// (three).
//
// If the body's own layers have fewer nodes than those of such a half space, free sides cut the shells, and their compliance
// grows in proportion: ShellCompliance. The reason for this block instead of one loaded by a plate, whose law is m^(d-2):
// docs/decisions/0009-two-layer.md.
// Source: Cavusoglu and Tendick, section 5.2 and fig. 16, which gives neither the block's loading nor figures.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// w_d(j), dimension 1 to 3, j >= 1.
double shell_compliance(int dimension, int shell);

/// W_d(m) in a body with given numbers of nodes in the layers around the contact: sum of w_d(j) r_j with
///     r_j = (h_j / h_1) / (n_j / n_1),      n_j = nodes in the body's layers j and j + 1,   h_j = the same in a half space.
class ShellCompliance {
 public:
  /// `layer_nodes`: nodes of layer 0 (the contact), 1, 2, ...; layers past the last have as many nodes as it. Fewer than three
  /// layers: nothing is cut.
  ShellCompliance(int dimension, const std::vector<int>& layer_nodes);
  /// A half space.
  explicit ShellCompliance(int dimension) : ShellCompliance(dimension, {}) {}
  /// Returns W_d(m), m >= 0.
  double operator()(int elements) const;

 private:
  double cut(int shell) const;
  int dimension_;
  std::vector<int> layer_nodes_;
};

/// Returns 1 if all elements of the body are parallel, 2 if they lie in parallel planes, else 3.
int dimension_of(const LumpedBody& body);

}  // namespace palpate
