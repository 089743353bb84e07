// All hexahedra of a body at once, in single precision, eight side by side: the forces of hexa_kernel.hpp as explicit integrators
// ask for them, at displacements u [m] and velocities v.
//
//     (F - 1, q) = sum u_i g_i^T,   (F', q') = sum v_i g_i^T      single precision
//     P_elastic(F)                                                of the neo-Hookean law a function of F - 1 in which nothing
//                                                                 cancels, in single precision; of others, and of fibres, in
//                                                                 double precision: what nearly cancels does it there
//     f_i -= (V P + what the modes push with) g_i                 single precision
//
// Of a box the g_i are the signs of a corner times one number a column, and all sums over its corners are one transform of Walsh
// and Hadamard: 24 additions a component, where there are 49 products otherwise. Cells in a row along the numbering of the nodes,
// as those of a lattice are, are read and written in order.
//
// Forces are right to some 1e-6 of the largest that an element has. Every sum is taken in the same order whatever the processor
// and the number of threads, and nothing is contracted: same bits on all of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/body/dynamics.hpp"
#include "server/body/spring_blocks.hpp"

namespace palpate {

/// Eight cells of one material.
struct HexaCells {
  static constexpr std::size_t kLanes = 8;
  /// The columns of a box's g by the bits of a corner: b_1, b_2, b_3 change sign with bit 0, 1, 2, h_1 = xi_2 xi_3 with 1 and 2,
  /// and so on.
  static constexpr std::size_t kBoxBits[7] = {1, 2, 4, 6, 5, 3, 7};
  struct alignas(32) Lanes {
    float of[kLanes];
  };
  std::array<std::array<std::uint32_t, kLanes>, 8> nodes{};  ///< of lanes that are not used: those of the first
  std::uint32_t material = 0, used = 0;                      ///< lanes, from the first on
  bool in_a_row = false;  ///< node i of lane l is nodes[i][0] + l, and one before that of i + 1 for even i
  /// Of boxes of one shape: V, k_a, and what the signs are times in g, column by column.
  float volume_m3 = 0, k[kModesOfHexa] = {}, times[7] = {};
  std::vector<Lanes> own;  ///< of others: numbers_of() of hexa_lanes.hpp; empty of boxes
  float damping_s = 0;
};

/// Of eight cells: how far they are strained, |F F^T - 1|, and the largest sum of a row of |F F^T|, a bound of its eigenvalues.
struct HexaStrains {
  HexaCells::Lanes strain, square;
};

struct HexaForceLoops {
  std::size_t width;  ///< doubles in a vector
  /// f += forces of the cells.
  void (*add_forces)(std::span<const TetraMaterial> materials, std::span<const HexaCells> cells, const NodeArrays& u,
                     const NodeArrays& v, NodeArrays& f);
  /// One for each of the cells.
  void (*strains)(std::span<const HexaCells> cells, const NodeArrays& u, std::span<HexaStrains> strains);
};
/// All that this processor can run, the widest last.
std::span<const HexaForceLoops> hexa_force_loops();

class HexaForces {
 public:
  explicit HexaForces(const Dynamics& dynamics);
  /// Whether the body is made of hexahedra, whose stress does not fade, and ligaments.
  static bool covers(const LumpedBody& body);

  std::size_t size() const { return count_; }  ///< elements
  /// What forces of all of them take, as it was measured [s]; no clock is read.
  double evaluation_s() const;
  /// All cells, in slabs that share nodes with their neighbours alone: the even ones may be added up at the same time, and then
  /// the odd ones, which takes every sum in one order.
  std::size_t slabs(bool odd) const { return (odd ? odd_ : even_).size(); }
  /// f += forces of a slab's cells.
  void add_forces(bool odd, std::size_t slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const;

  std::span<const TetraMaterial> materials() const { return materials_; }
  std::span<const HexaCells> cells(bool odd, std::size_t slab) const { return (odd ? odd_ : even_)[slab]; }

  /// How much the largest eigenvalues of K and D have grown since the body was at rest, at least 1, as far as the elements tell
  /// that are strained most: that of dP/dF beside what it was, and of F F^T.
  struct Growth {
    double stiffness = 1, damping = 1;
  };
  Growth growth(const NodeArrays& u) const;

 private:
  using Slab = std::vector<HexaCells>;
  Mat3 deformation(const HexaCells& cells, std::size_t lane, const NodeArrays& u) const;
  std::vector<TetraMaterial> materials_;
  std::vector<double> stiffest_at_rest_;  // of each: the largest eigenvalue of dP/dF
  std::vector<Slab> even_, odd_;
  std::size_t count_ = 0;
};

}  // namespace palpate
