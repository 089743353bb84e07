// The specimens of the paper's frequency-domain experiments: lattices at rest, held by an instrument at one node.
//
// Section 4 (figs 4-6): a sheet of n x n nodes over a 100 mm square, every node joined to its eight neighbours, top edge free,
// the other three fixed, the instrument on the top middle node. The paper's "12 x 12" counts cells: 13 x 13 nodes, 131 of them
// free, two coordinates each, 524 states. It prints neither stiffness nor damping nor mass; the defaults here are those at which
// its claims hold. Section 3: a cube of n x n x n free nodes on one more, fixed layer, the instrument on its top middle node;
// with n = 10 the paper's 6000th order, of which 5994 states remain when the instrument holds a node.
//
// The response depends on the three numbers only through b / sqrt(k m), except for the scales k of force and sqrt(m / k) of time.
// Source: Cavusoglu and Tendick, sections 3 and 4.
#pragma once

#include "bench/paper/second_order.hpp"

namespace palpate {

/// Values for every element and every node.
struct Material {
  double stiffness_n_m = 100, damping_n_s_m = 0.5, node_mass_kg = 0.001;

  /// b / sqrt(k m): dimensionless strength of the damping.
  double damping_ratio() const;
};

inline constexpr int kPaperNodes = 13;         ///< nodes along an edge of the sheet
inline constexpr double kSpecimenSizeM = 0.1;  ///< length of an edge, for any number of nodes

/// A body at rest with the node that the instrument holds. It cannot be copied or moved, as Dynamics points to the body.
class Specimen {
 public:
  Specimen(LumpedBody body, std::uint32_t port_node);
  Specimen(const Specimen&) = delete;
  Specimen& operator=(const Specimen&) = delete;

  static Specimen sheet(int nodes, const Material& material);
  static Specimen cube(int nodes, const Material& material);

  const LumpedBody& body() const { return body_; }
  const Dynamics& dynamics() const { return dynamics_; }
  const BodyState& rest() const { return rest_; }
  std::uint32_t port_node() const { return port_node_; }

  /// Whole body at the port.
  SecondOrderSystem system() const;
  /// Nodes within `layers` layers of neighbours around the port, all others held: figs 7 and 8.
  SecondOrderSystem ring(int layers) const;
  /// By node: 1 if it lies within `layers` layers of the port (itself included).
  std::vector<std::uint8_t> near_port(int layers) const;

 private:
  LumpedBody body_;
  Dynamics dynamics_;
  BodyState rest_;
  std::uint32_t port_node_;
};

}  // namespace palpate
