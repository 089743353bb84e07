// Figure 16: the largest singular value of the static stiffness of a block against the number of elements along its edge.
//
// A block is a lattice of m elements along its edge between the loaded face and the fixed end, every element with the same
// stiffness k for any m: finer meshes of a block of fixed size. At rest, the statics of a lattice do not depend on its size. The
// stiffness matrix is the force that holds the displaced loaded nodes while the others yield, in units of k. Loadings, in d
// dimensions:
//
//     plate    the whole top face moves as one; the bottom is fixed; sides are free. A plate on a column of section m^(d-1) and
//              length m:                                                           grows as m^(d-2)
//     nodes    the same block, each node of the top by itself: the worst pattern alternates between neighbours and is felt one
//              element deep:                                                       tends to a constant
//     node     the same block, only the middle node of the top loaded:             1/m, 1/ln m, constant
//     contact  a box of one layer of cells around a node in the middle of a free face moves as one; every node m elements further
//              out is fixed: the outer elements of the two-layer model stand for this. 1/m, 1/ln m, constant: block_scaling.hpp
//
// In one dimension all four are m springs in series, k/m.
// Source: Cavusoglu and Tendick, section 5.2, whose text leaves the loading open.
#pragma once

#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

enum class BlockLoading { plate, nodes, node, contact };
inline constexpr BlockLoading kBlockLoadings[] = {BlockLoading::plate, BlockLoading::nodes, BlockLoading::node,
                                                  BlockLoading::contact};
const char* name_of(BlockLoading loading);

/// Largest singular value [k].
double block_stiffness(BlockLoading loading, int dimension, int elements);

struct BlockCurve {
  BlockLoading loading = BlockLoading::plate;
  int dimension = 3;
  std::vector<int> elements;
  std::vector<double> stiffness;  ///< [k]
  double exponent = 0;            ///< p of m^p, by least squares in logarithms over the finer half of the curve
};
BlockCurve block_curve(BlockLoading loading, int dimension, int elements_max);

/// Fit of c and a in w_d(m) = (c + a m)^-(d-1), m > 1, by least squares on w^(-1/(d-1)), with w_d(m) = W(m) - W(m-1), W(m) =
/// S(1)/S(m).
struct ShellFit {
  double first = 0, growth = 0;
  double worst = 0;  ///< largest relative difference between fitted and measured W
};
ShellFit fit_shells(const BlockCurve& contact);
/// Largest relative difference of 1/W_d(m) between the two-layer model and the measurement.
double scaling_error(const BlockCurve& contact);

}  // namespace palpate
