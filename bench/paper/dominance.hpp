// Are the dominant modes of a body local to the contact? The off-line check that section 7 of the paper asks for.
//
// The body at rest is balanced with the instrument at a node, as in section 4. Its dominant states are those that carry kShare of
// the sum of the Hankel values. State i stands for displacements q_i and velocities v_i of the nodes; its energy at a node is
//     1/2 m |v|^2 + the node's share of the elastic energy of each of its elements, divided evenly among their moving nodes:
//                   1/2 k e^2 of a spring, V (mu |E|^2 + lambda/2 tr(E)^2) of a tetrahedron of volume V at the small strain E
// and the dominant energy is the sum over i of hankel_i / sum hankel times the shares of state i. Layer k is the set of nodes
// that are k elements away from the contact.
//
// Those states respond to all frequencies alike, and fast ones are local in any body. The deformation under a slow push is given
// by the elastic energy of the static response q_s = K^-1 B_k, averaged over the axes: it lies deep in a body that is softer
// below.
//
// Whether `ring`, which holds all nodes beyond a layer, is good enough is not inferred from that distribution: the ring models
// themselves are compared with the body. error(omega) = |G_ring - G| / |G|, largest singular values. Source: Cavusoglu and
// Tendick, 4 and 7.
#pragma once

#include <vector>

#include "bench/paper/response.hpp"
#include "bench/paper/specimen.hpp"

namespace palpate {

struct RingError {
  int layers = 0, states = 0;
  double dc = 0, band_10_100 = 0, band_100_1000 = 0;  ///< largest relative error at 0, in 10-100 Hz, in 100-1000 Hz
};

struct LayerShare {
  int layer = 0;
  double within = 0;       ///< share of the dominant energy in this layer and nearer ones
  double slow_within = 0;  ///< share of the elastic energy of a slow push there
  double even_within = 0;  ///< share that energy spread evenly over the free nodes would have there
  double distance_m = 0;   ///< mean distance of its nodes from the contact
};

struct Dominance {
  static constexpr double kShare = 0.99;
  static constexpr double kRingError = 0.1;  ///< just-noticeable difference of force

  int states_full = 0, states_dominant = 0;
  std::vector<double> hankel_n_m;
  std::vector<LayerShare> layers;
  double distance_50_m = 0, distance_90_m = 0;  ///< radius that contains this share of the dominant energy
  double extent_m = 0;                          ///< distance of the farthest moving node
  std::vector<RingError> rings;
  int ring_layers_fast = 0;  ///< fewest layers with which the ring keeps to kRingError in 100-1000 Hz; 0: none of those tried
  int ring_layers_all = 0;   ///< the same, also in 10-100 Hz
};

/// `layers_max`: largest ring to try, at least 1. Throws std::runtime_error if the body, or the node alone, is not stable at
/// rest.
Dominance dominance(const Specimen& specimen, int layers_max);

}  // namespace palpate
