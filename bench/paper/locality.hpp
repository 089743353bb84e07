// Location of a small model's states in the body, and decay of the body's stress: the paper's two arguments that a local model is
// enough (section 4, fig. 6).
//
// A reduced state z_i stands for the displacements u = T_i and velocities v = T'_i of all nodes (BalancedReduction::directions).
// Its energy is that of the elements, k/2 (d . (u_a - u_b))^2 at their midpoints, and m/2 |v|^2 of the nodes; the state is local
// if most of it lies near the port.
//
// Stress under a static push along the normal: sigma = 1/(2 V) sum_e T_e L_e d d^T over the elements of a node (T tension, L
// length, d direction, V the volume of a cell; in a sheet its area, sigma in N/m). Under a point load on a half-space it falls
// straight below the load as 3 P / (2 pi r^2) (Boussinesq); on a half-plane, such as a sheet, as 2 P / (pi r) (Flamant).
// Source: Timoshenko and Goodier, Theory of Elasticity, sections 36 and 138.
#pragma once

#include <vector>

#include "bench/paper/specimen.hpp"

namespace palpate {

struct StateShape {
  std::vector<double> displacement, velocity;  ///< magnitudes by node of the body; the largest of each state is 1
  std::vector<double> share_within;            ///< share of the energy within each radius
};

/// `directions` has 2 n rows, displacements of `system`'s coordinates above velocities.
std::vector<StateShape> state_shapes(const Specimen& specimen, const SecondOrderSystem& system, const Matrix& directions,
                                     const std::vector<double>& radii_m);

/// Share of the body's area or volume within each radius of the port, which a state spread evenly would have.
std::vector<double> even_share(const Specimen& specimen, const std::vector<double>& radii_m);

struct StressAt {
  double depth_m = 0, stress = 0;
};
/// Stress straight below the port, one entry per layer of nodes, without port and fixed nodes, for a unit displacement of the
/// port along the normal (y of a sheet, z of a cube).
std::vector<StressAt> stress_below_port(const Specimen& specimen);
/// Exponent p of the least-squares fit stress ~ depth^-p between two depths.
double decay_exponent(const std::vector<StressAt>& stress, double from_m, double to_m);

}  // namespace palpate
